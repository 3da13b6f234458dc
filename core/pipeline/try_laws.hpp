// Which law the observations of a feature's start are explained by: a batch start under each.
//
// Not for the real-time path: it allocates.
#pragma once

#include <optional>

#include "core/estimation/batch_start.hpp"
#include "core/estimation/measurement_model.hpp"
#include "core/phase/law_trial.hpp"
#include "core/pipeline/feature_slot.hpp"

namespace perimap {

// Of a start whose outcome is there. The phases' deviations are those of the R peaks alone: what the law is doubted by
// is what is asked, and a cycle that ended out of rhythm tells more of it than others. Nothing where one of the fits
// has no cost, where no law explains what was seen (its R peaks are not the heart's), or while breathing may move it
// all.
[[nodiscard]] std::optional<LawTrial> try_laws(const BatchStartExchange& start, const PixelModel& model,
                                               const BasisLayout& layout, const Prior& prior,
                                               const BatchSettings& settings);

}  // namespace perimap
