#include <nlohmann/json.hpp>

#include "bodymodel/formats/makehuman_rig.h"
#include "core/io/json.h"
#include "fuzz/reader.h"

// A rig of either kind, and the weights of its bones in the same file.
ATELIER_FUZZ_READER(rig) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const nlohmann::json json = atelier::parse_json(text, "rig");
  const atelier::VertexGroups groups = {{"joint-pelvis", {0, 1}}, {"joint-head", {2, 3}}};
  const atelier::Rig rig = atelier::parse_rig(json, groups, 1000, "rig");
  for (std::size_t b = 0; b < rig.size(); ++b) {
    ATELIER_CHECK(rig[b].parent < static_cast<int>(b), "a parent behind its child");
  }
  if (json.contains("weights")) {
    atelier::parse_rig_weights(json, rig, 1000, "rig");
  }
}
