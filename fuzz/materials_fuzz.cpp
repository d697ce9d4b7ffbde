#include <string_view>

#include "fuzz/reader.h"
#include "simulation/files/material_file.h"

/// What is read is in its ranges, can be written as materials that were given, and reads the same.
ATELIER_FUZZ_READER(materials) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  std::vector<atelier::GarmentMaterial> given;
  for (const auto& [garment, found] : atelier::parse_materials(text, "material.json")) {
    ATELIER_CHECK(found.material.density > 0 && found.material.bending >= 0 &&
                      found.credible_low.stretch >= 0 && found.credible_high.bending >= 0,
                  "a material that there is");
    given.push_back({garment, found.material, {}});
  }
  const std::string written = atelier::materials_text(given);
  const auto again = atelier::parse_materials(written);
  ATELIER_CHECK(again.size() == given.size(), "as many materials as were written");
  for (const atelier::GarmentMaterial& one : given) {
    const atelier::Material& material = again.at(one.garment).material;
    ATELIER_CHECK(material.name == one.material.name && material.shear == one.material.shear &&
                      material.thickness == one.material.thickness,
                  "a material reads back as it was");
  }
}
