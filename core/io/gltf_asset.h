#pragma once

#include <string>

#include "core/io/json_place.h"
#include "core/io/mesh_gltf.h"

namespace atelier {

/// Text of asset.copyright: the copyright, and behind it "Consent: " and the consent; "" of none.
std::string gltf_copyright(const std::string& copyright, const std::string& consent);

/// Copyright and consent of a file's `asset`, as gltf_copyright and asset.extras.consent have them.
/// Values that are no texts count as none; of texts the first 4,096 bytes.
void read_gltf_asset(const JsonPlace& asset, GltfScene& scene);

}  // namespace atelier
