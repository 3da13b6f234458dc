// A mesh as it goes over the wire, of an organ that is made up, with a model whose clock it moves by.
#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <utility>

#include "core/phase/cardiac_clock_tracker.hpp"
#include "core/pipeline/surface_maker.hpp"
#include "daemon/publishing/model_moment.hpp"
#include "daemon/publishing/wire_mesh.hpp"
#include "daemon/publishing/wire_model.hpp"
#include "tests/unit/surface/made_organ.hpp"

namespace perimap::test {

// Makes one job after the other, as housekeeping does.
class ServedMaker {
 public:
  explicit ServedMaker(std::size_t vertices, std::shared_ptr<const OrganModel> model = nullptr)
      : maker_(kLayout, 200, vertices, true, std::move(model)), thread_([this] { maker_.serve(); }) {}
  ServedMaker(const ServedMaker&) = delete;
  ServedMaker& operator=(const ServedMaker&) = delete;
  ~ServedMaker() {
    maker_.dismiss();
    thread_.join();
  }

  SurfaceMaker& operator*() noexcept { return maker_; }
  SurfaceMaker* operator->() noexcept { return &maker_; }

  // Seen from the origin at `capture`, and adopted.
  void make(const std::vector<SurfaceEvidence>& evidence, Instant capture, PhaseLaw law = PhaseLaw::kLinear) {
    SurfaceJob& job = *maker_.job();
    job.evidence.assign(evidence.begin(), evidence.end());
    job.camera_W_mm = Vector3d::Zero();
    job.law = law;
    job.capture = capture;
    job.frame_sequence = 77;
    maker_.request();
    maker_.adopt();
  }

 private:
  SurfaceMaker maker_;
  std::thread thread_;
};

class MadeMesh {
 public:
  explicit MadeMesh(std::size_t vertices = 800, double hole_mm = 0.0, std::string source = "theatre 3")
      : maker_(vertices), wire_mesh_(identity(source)), wire_model_(identity("theatre 3")) {
    std::mt19937_64 random(61);
    const auto places = places_on_disc(100, 40.0, 3.5, random, hole_mm);
    CardiacClockTracker tracker{CardiacClockSettings{}};
    for (int beat = 0; beat < 20; ++beat) {
      const Instant peak(std::chrono::milliseconds(1000 + 800 * beat));
      tracker.on_r_peak({peak, peak + std::chrono::milliseconds(60), 1.0, std::chrono::milliseconds(1)});
    }
    clock_ = tracker.clock();
    now_ = clock_.anchor() + std::chrono::milliseconds(150);
    maker_.make(evidence_on(places, 0.1, random), now_);
    moment_.layout = kLayout;
    moment_.clock = clock_;
    moment_.now = now_;
    moment_.footing.mapped = true;
    moment_.validity = std::chrono::milliseconds(700);
  }

  [[nodiscard]] const perimap_SurfaceMesh& mesh() {
    if (const perimap_SurfaceMesh* news = wire_mesh_.news(*maker_, now_, std::chrono::hours(1))) newest_ = news;
    return *newest_;
  }
  [[nodiscard]] const perimap_SurfaceModel& model() { return wire_model_.fill(moment_); }
  [[nodiscard]] Instant now() const noexcept { return now_; }
  [[nodiscard]] const CardiacClock& clock() const noexcept { return clock_; }
  [[nodiscard]] std::shared_ptr<const MadeSurface> made() { return maker_->newest(); }

 private:
  static Identity identity(const std::string& source) { return {source, ReleaseStream::kFrame, "tracker"}; }

  ServedMaker maker_;
  WireMesh wire_mesh_;
  WireModel wire_model_;
  CardiacClock clock_;
  Instant now_;
  ModelMoment moment_;
  const perimap_SurfaceMesh* newest_ = nullptr;
};

}  // namespace perimap::test
