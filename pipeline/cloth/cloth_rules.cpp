#include "pipeline/cloth/cloth_rules.h"

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
    IdleRule{"search.", kFabricGiven, kFitted},       IdleRule{"use_prior", kFabricGiven, kFitted},
    IdleRule{"tracking_rate", kFabricGiven, kFitted}, IdleRule{"sequence", kFabricGiven, kFitted},
    IdleRule{"holding", kFabricGiven, kFitted},       IdleRule{"frames", kFabricGiven, kFitted},
    IdleRule{"edge_length", kFabricGiven, kFitted},   IdleRule{"substeps", kFabricGiven, kFitted},
    IdleRule{"self_contact", kFabricGiven, kFitted},
};

constexpr std::array kClothIdle = {
    IdleRule{"material.shear",
             {{{"membrane", "springs"}, {"shear", "none"}}},
             "--shear cross or --membrane strain"},
    IdleRule{"wind", {{{"xpbd.air_density", "0"}, {}}}, "more --xpbd.air-density"},
    IdleRule{"xpbd.drag", {{{"xpbd.air_density", "0"}, {}}}, "more --xpbd.air-density"},
    IdleRule{"xpbd.lift", {{{"xpbd.air_density", "0"}, {}}}, "more --xpbd.air-density"},
    IdleRule{"xpbd.air_density",
             {{{"xpbd.drag", "0"}, {"xpbd.lift", "0"}}},
             "--xpbd.drag or --xpbd.lift"},
    IdleRule{"relaxing.", {{{"relax", "false"}, {}}}, "--relax", true},
    IdleRule{"rest_angles", {{{"relax", "true"}, {"sewn", "", true}}}, "--relax false"},
    IdleRule{"seam_stiffness", {{{"sewn", "true"}, {}}}, "--sewn false"},
    IdleRule{"xpbd.jacobi_radius", {{{"xpbd.sweep", "gauss-seidel"}, {}}}, "--xpbd.sweep jacobi"},
    IdleRule{"xpbd.self_thickness", {{{"xpbd.self_contact", "false"}, {}}}, "--xpbd.self-contact"},
    IdleRule{"xpbd.self_friction", {{{"xpbd.self_contact", "false"}, {}}}, "--xpbd.self-contact"},
    IdleRule{"xpbd.self_interval", {{{"xpbd.self_contact", "false"}, {}}}, "--xpbd.self-contact"},
};

}  // namespace

const OptionRules& material_rules() {
  static constexpr OptionRules rules{.order = kMaterialOrder, .idle = kMaterialIdle};
  return rules;
}

const OptionRules& cloth_rules() {
  static constexpr OptionRules rules{.idle = kClothIdle};
  return rules;
}

}  // namespace atelier
