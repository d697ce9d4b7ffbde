#pragma once

#include <string>
#include <vector>

#include "core/garment.h"
#include "core/options.h"

namespace atelier {

/// Placeholder for the fabric's own value.
constexpr double kFabricsOwn = -1;

/// A material of which nothing is said but its name: every number kFabricsOwn.
Material fabrics_own_material(const std::string& name = "custom");

/// The options of a material that is said: "name", one of `names`, and every number, of which
/// kFabricsOwn takes the named fabric's.
OptionTable describe_material(Material& said, std::vector<std::string> names);

/// The material that is said: the named fabric's, of "custom" the defaults of Material, of "fitted"
/// what was fitted, with every value that was said in its place. Throws UsageError for a value
/// below its range that is not kFabricsOwn, and for a stretching stiffness of 0.
Material resolve_material(const Material& said, const Material& fitted = {});

}  // namespace atelier
