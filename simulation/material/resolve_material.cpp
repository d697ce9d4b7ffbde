#include "simulation/material/resolve_material.h"

#include <utility>
#include <variant>

#include "core/usage_error.h"
#include "simulation/material/fabric.h"

namespace atelier {

Material fabrics_own_material(const std::string& name) {
  Material material;
  material.name = name;
  for (const OptionField& field : describe(material).fields) {
    *std::get<double*>(field.target) = kFabricsOwn;
  }
  return material;
}

OptionTable describe_material(Material& said, std::vector<std::string> names) {
  OptionTable table;
  table.add("name", said.name, std::move(names),
            "Fabric with measured values (estimated ones for silk, see docs/methods/material.md); "
            "custom: "
            "none. Values given beside it override its own");
  Material custom;
  const OptionTable defaults = describe(custom);
  OptionTable numbers = describe(said);
  for (std::size_t i = 0; i < numbers.fields.size(); ++i) {
    OptionField& field = numbers.fields[i];
    field.min = kFabricsOwn;
    field.help += "; -1: the fabric's own (custom: " + option_text(defaults.fields[i]) + ")";
  }
  return table.add(numbers);
}

Material resolve_material(const Material& said, const Material& fitted) {
  Material given = said;
  Material material;
  if (given.name == "fitted") {
    material = fitted;
  } else if (!given.name.empty() && given.name != "custom") {
    material = fabric_material(given.name);
  }
  material.name = given.name;
  const OptionTable to = describe(material);
  const OptionTable from = describe(given);
  for (std::size_t i = 0; i < from.fields.size(); ++i) {
    const double value = *std::get<double*>(from.fields[i].target);
    if (value == kFabricsOwn) {
      continue;
    }
    if (value < to.fields[i].min) {
      throw UsageError("material." + to.fields[i].name + " cannot be " +
                       option_text(from.fields[i]) + ": it takes a " + option_range(to.fields[i]) +
                       ", or -1 for the fabric's own");
    }
    *std::get<double*>(to.fields[i].target) = value;
  }
  if (!(material.stretch_warp > 0) || !(material.stretch_weft > 0)) {
    throw UsageError(
        "material.stretch_warp and material.stretch_weft cannot be 0: nothing would hold the cloth "
        "together; raise them (fabrics have 100 and more)");
  }
  return material;
}

}  // namespace atelier
