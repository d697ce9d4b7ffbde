#include "pipeline/cloth/cloth_rules.h"

#include <algorithm>

#include "simulation/solver.h"

namespace atelier {
namespace {

/// Of `material`, whose table alone has a search: with a fabric nothing is tried.
constexpr std::array<IdleRule::Value, 2> kFabricGiven = {
    {{"material.name", "fitted", true}, {"search.coarse", "", true}}};
constexpr const char* kFitted = "--material.name fitted";

constexpr std::array kMaterialOrder = {
    OrderRule{"search.stretch_low", "search.stretch_high", is_less, kTakesLess},
    OrderRule{"search.bending_low", "search.bending_high", is_less, kTakesLess},
};

constexpr std::array kMaterialIdle = {
    IdleRule{"search.", kFabricGiven, kFitted},
    IdleRule{"use_prior", kFabricGiven, kFitted},
    IdleRule{"tracking_rate", kFabricGiven, kFitted},
    IdleRule{"sequence", kFabricGiven, kFitted},
    IdleRule{"holding", kFabricGiven, kFitted},
    IdleRule{"frames", kFabricGiven, kFitted},
    IdleRule{"edge_length", kFabricGiven, kFitted},
    IdleRule{"xpbd.", kFabricGiven, kFitted},
    IdleRule{"self_contact", kFabricGiven, kFitted},
    IdleRule{"solver", kFabricGiven, kFitted},
    IdleRule{"projective_friction.", kFabricGiven, kFitted},
};

constexpr std::array kClothIdle = {
    IdleRule{"material.shear",
             {{{"membrane", "springs"}, {"shear", "none"}}},
             "--shear cross or --membrane strain"},
    IdleRule{"wind", {{{"air_density", "0"}, {}}}, "more --air-density"},
    IdleRule{"drag", {{{"air_density", "0"}, {}}}, "more --air-density"},
    IdleRule{"lift", {{{"air_density", "0"}, {}}}, "more --air-density"},
    IdleRule{"air_density", {{{"drag", "0"}, {"lift", "0"}}}, "--drag or --lift"},
    IdleRule{"relaxing.", {{{"relax", "false"}, {}}}, "--relax", true},
    IdleRule{"rest_angles", {{{"relax", "true"}, {"sewn", "", true}}}, "--relax false"},
    IdleRule{"seam_stiffness", {{{"sewn", "true"}, {}}}, "--sewn false"},
    IdleRule{"xpbd.jacobi_radius", {{{"xpbd.sweep", "gauss-seidel"}, {}}}, "--xpbd.sweep jacobi"},
    IdleRule{"self_thickness", {{{"self_contact", "false"}, {}}}, "--self-contact"},
    IdleRule{"self_friction", {{{"self_contact", "false"}, {}}}, "--self-contact"},
    IdleRule{"xpbd.self_interval", {{{"self_contact", "false"}, {}}}, "--self-contact"},
};

/// "projective_friction." of "projective-friction".
std::string section_of(std::string solver) {
  std::replace(solver.begin(), solver.end(), '-', '_');
  return solver + ".";
}

std::string flag_named(const std::string& option) {
  std::string flag = "--" + option;
  std::replace(flag.begin(), flag.end(), '_', '-');
  return flag;
}

/// Options of a solver that was not chosen.
std::vector<std::string> idle_solvers(const OptionTable& table) {
  std::vector<std::string> problems;
  for (const std::string& solver : solver_names()) {
    const std::string section = section_of(solver);
    for (const OptionField& field : table.fields) {
      const auto start = start_of(field.name, section);
      const OptionField* chosen = start ? field_named(table, *start + "solver") : nullptr;
      if (!is_said(field) || chosen == nullptr || option_text(*chosen) == solver) {
        continue;
      }
      const std::string its_own = *start + section_of(option_text(*chosen)) +
                                  field.name.substr(start->size() + section.size());
      const bool has_its_own = field_named(table, its_own) != nullptr;
      problems.push_back(field.name + " does nothing with " + chosen->name + " " +
                         option_text(*chosen) + ": leave it out, " +
                         (has_its_own ? "take " + flag_named(its_own) + ", " : "") + "or say " +
                         flag_named(chosen->name) + " " + solver);
    }
  }
  return problems;
}

}  // namespace

const OptionRules& material_rules() {
  static constexpr OptionRules rules{.order = kMaterialOrder, .idle = kMaterialIdle};
  return rules;
}

const OptionRules& cloth_rules() {
  static constexpr OptionRules rules{.idle = kClothIdle, .others = idle_solvers};
  return rules;
}

}  // namespace atelier
