#include "core/pipeline/surface_maker.hpp"

#include <utility>

namespace perimap {
namespace {

// Kernels change slowly, and learning them is most of the work.
constexpr std::uint64_t kFitsAKernel = 4;

}  // namespace

SurfaceMaker::SurfaceMaker(const BasisLayout& layout, std::size_t features, std::size_t vertices, bool lockstep,
                           std::shared_ptr<const OrganModel> model)
    : layout_(layout), vertices_(vertices), model_(std::move(model)), hand_over_(lockstep) {
  job_.evidence.reserve(features);
}

SurfaceJob* SurfaceMaker::job() noexcept { return hand_over_.under_way() ? nullptr : &job_; }

void SurfaceMaker::request() noexcept {
  ++job_.number;
  hand_over_.begin();
}

bool SurfaceMaker::adopt() noexcept {
  if (!hand_over_.finish()) return false;
  adopted_.store(job_.number, std::memory_order_relaxed);
  return true;
}

bool SurfaceMaker::there() const noexcept {
  const std::uint64_t adopted = adopted_.load(std::memory_order_relaxed);
  return made_ && adopted > withdrawn_.load(std::memory_order_relaxed);
}

void SurfaceMaker::withdraw() noexcept { withdrawn_.store(job_.number, std::memory_order_relaxed); }

void SurfaceMaker::serve() {
  hand_over_.serve([this] { make(); });
}

void SurfaceMaker::dismiss() noexcept { hand_over_.dismiss(); }

void SurfaceMaker::make() {
  auto made = std::make_shared<MadeSurface>();
  made->number = job_.number;
  made->law = job_.law;
  made->capture = job_.capture;
  made->frame_sequence = job_.frame_sequence;
  if (job_.anew) {
    fits_ = 0;
    kernels_ = {};
  }
  KernelSearch search = fits_ % kFitsAKernel == 0 ? KernelSearch::kNearby : KernelSearch::kNone;
  if (fits_ == 0) search = KernelSearch::kAnew;
  auto surface = PeriodicSurface::fit(layout_, job_.evidence, job_.camera_W_mm, {}, kernels_, search,
                                      model_ ? model_->motion : nullptr);
  made_ = surface.has_value();
  if (surface) {
    ++fits_;
    kernels_ = surface->kernels();
    made->of_model = model_ != nullptr;
    made->mesh = model_ ? mesh_of(*surface, *model_) : mesh_of(*surface, vertices_);
    // After support is decided: a set-up that is a little wrong moves all of it, and hides no place.
    for (const int diagonal : {0, 3, 5}) {
      made->mesh.covariances_W_mm2.row(diagonal).array() += job_.setup_variance_mm2;
    }
    made->surface.emplace(*std::move(surface));
  } else {
    made->refusal = std::move(surface.error());
  }
  const std::lock_guard lock(mutex_);
  // What was waiting was adopted before this was asked for.
  if (waiting_) current_ = std::move(waiting_);
  waiting_ = std::move(made);
}

std::shared_ptr<const MadeSurface> SurfaceMaker::newest() {
  const std::lock_guard lock(mutex_);
  if (waiting_ && waiting_->number <= adopted_.load(std::memory_order_relaxed)) current_ = std::move(waiting_);
  if (!current_ || current_->number <= withdrawn_.load(std::memory_order_relaxed)) return nullptr;
  return current_;
}

bool SurfaceMaker::withdrawn() const noexcept { return withdrawn_.load(std::memory_order_relaxed) > 0; }

}  // namespace perimap
