#include "core/pipeline/surface_keeper.hpp"

#include <algorithm>
#include <utility>

#include "core/pipeline/feature_stages.hpp"

namespace perimap {
namespace {

constexpr int kUpdatesOfItsOwn = 150;
constexpr Duration kMadeEvery = std::chrono::seconds(1);
// As long as a feature is believed that nobody sees: the mean camera is where they were seen from.
constexpr Duration kCameraMemory = kBelievedUnseen;

}  // namespace

SurfaceKeeper::SurfaceKeeper(std::span<FeatureSlot> slots, MapBank& bank, SurfaceMaker& maker, Duration adopted_after,
                             PipelineCounters& counters)
    : slots_(slots),
      bank_(bank),
      maker_(maker),
      adopted_after_(adopted_after),
      counters_(counters),
      gathered_(slots.size()) {}

void SurfaceKeeper::on_frame(const FrameRecord& frame, PhaseLaw law, const FrameDoubts& doubts) noexcept {
  // What was made of features that are no longer called converged is void at once.
  if (doubts.setup_doubted && !setup_doubted_) begin_again();
  setup_doubted_ = doubts.setup_doubted;
  if (asked_ && frame.index >= adopt_at_) {
    const bool due = frame.index == adopt_at_;
    asked_ = !maker_.adopt();
    if (!asked_) there_ = maker_.there();
    if (asked_ && due) counters_.adoptions_late.add();
  }
  if (frame.pose.valid()) camera_.add(frame.pose.X_WC.t, frame.rate.frames(kCameraMemory));
  gather(frame, doubts);
  if (frame.index >= next_request_at_ && fresh_ >= slots_.size() && camera_.frames > 0)
    request(frame, law, doubts.setup_variance_mm2());
}

void SurfaceKeeper::gather(const FrameRecord& frame, const FrameDoubts& doubts) noexcept {
  const std::uint64_t round = frame.rate.frames(kMadeEvery);
  const std::size_t count = (slots_.size() + round - 1) / round;
  for (std::size_t i = 0; i < count; ++i) {
    const FeatureSlot& slot = slots_[next_slot_];
    Gathered& gathered = gathered_[next_slot_];
    // What began on the surface tells of itself at first what that said.
    const bool its_own = !slot.began_on_surface || slot.updates >= kUpdatesOfItsOwn;
    gathered.usable = slot.state == SlotState::kMapped && its_own && !doubts.setup_doubted &&
                      is_called_converged(slot, frame.stamp.capture, doubts);
    if (gathered.usable) {
      bank_.get(static_cast<int>(next_slot_), estimate_);
      add_lasting_errors(slot, estimate_.P);
      gathered.evidence = surface_evidence(slot.id, bank_.layout(), estimate_);
      gathered.last_observed = slot.last_observed;
      gathered.usable = is_usable(gathered.evidence, bank_.layout());
    }
    next_slot_ = (next_slot_ + 1) % slots_.size();
    ++fresh_;
  }
}

void SurfaceKeeper::request(const FrameRecord& frame, PhaseLaw law, double setup_variance_mm2) noexcept {
  SurfaceJob* job = maker_.job();
  if (job == nullptr) return;
  job->evidence.clear();
  for (const Gathered& gathered : gathered_) {
    if (gathered.usable && frame.stamp.capture - gathered.last_observed <= kBelievedUnseen) {
      job->evidence.push_back(gathered.evidence);
    }
  }
  job->camera_W_mm = camera_.W_mm;
  job->law = law;
  job->anew = std::exchange(anew_, false);
  job->setup_variance_mm2 = setup_variance_mm2;
  job->capture = frame.stamp.capture;
  job->frame_sequence = frame.stamp.sequence;
  maker_.request();
  asked_ = true;
  fresh_ = 0;
  adopt_at_ = frame.index + frame.rate.frames(adopted_after_);
  next_request_at_ = frame.index + frame.rate.frames(kMadeEvery);
}

void SurfaceKeeper::begin_again() noexcept {
  maker_.withdraw();
  there_ = false;
  anew_ = true;
  std::fill(gathered_.begin(), gathered_.end(), Gathered());
  fresh_ = 0;
}

void SurfaceKeeper::forget() noexcept {
  begin_again();
  camera_ = MeanCamera();
}

}  // namespace perimap
