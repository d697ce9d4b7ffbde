#pragma once

#include <string>
#include <vector>

#include "core/io/mesh_gltf.h"

namespace atelier {

/// Adds to a scene that is made of files the copyright and the consent that these say: of glTF in
/// `asset`, of a file in a capture in the capture's own files (read_consent). What is no file is
/// passed over. Throws DataError for a consent file that is wrong.
void keep_rights(const std::vector<std::string>& sources, GltfScene& scene);

}  // namespace atelier
