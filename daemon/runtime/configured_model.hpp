// The preoperative model that the configuration names.
#pragma once

#include <memory>

#include "core/surface/model_mesh.hpp"
#include "daemon/config/configuration.hpp"
#include "daemon/config/wrong_key.hpp"

namespace perimap {

// Null where model.file names no file. Fails when it cannot be read, is no surface of an organ (check_mesh), or has
// more vertices than are worth publishing each second; and when what model.other_files name is not the same mesh,
// vertex for vertex, at phases that tell a motion.
[[nodiscard]] tl::expected<std::shared_ptr<const OrganModel>, WrongKeys> configured_model(
    const ModelConfiguration& configuration);

}  // namespace perimap
