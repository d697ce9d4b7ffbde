#include "simulation/files/frame_words.h"

#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <variant>

#include "core/io/json_text.h"
#include "core/printable.h"
#include "simulation/files/simulation_words.h"
#include "simulation/material/bending_rigidity.h"
#include "simulation/material/membrane_in_use.h"

namespace atelier {
namespace {

using Json = nlohmann::json;

Json membrane_json(const MembraneInUse& membrane) {
  const auto known = [](const std::optional<double>& value) {
    return value ? Json(*value) : Json(nullptr);
  };
  return {{"young_warp", membrane.warp},
          {"young_weft", membrane.weft},
          {"poisson", known(membrane.poisson)},
          {"shear", known(membrane.shear)},
          {"bending", membrane.bending}};
}

}  // namespace

std::string frame_json(const FrameReport& r) {
  Json json = {{"frame", r.frame},
               {"strain", {{"p50", r.strain_p50}, {"p95", r.strain_p95}, {"max", r.strain_max}}},
               {"energy_j", {{"kinetic", r.kinetic_energy}, {"elastic", r.elastic_energy}}},
               {"body",
                {{"contacts", r.body_contacts},
                 {"inside", r.penetrating},
                 {"depth_m", r.penetration_depth}}},
               {"self",
                {{"contacts", r.self_contacts},
                 {"candidates", r.self_candidates},
                 {"self_searches", r.self_searches},
                 {"self_renewals", r.self_renewals}}}};
  const auto counted = [](auto value) { return value >= 0 ? Json(value) : Json(nullptr); };
  json["residual"] = {{"spring_m", counted(r.spring_residual)},
                      {"hinge_rad", counted(r.hinge_residual)},
                      {"strain", counted(r.strain_residual)}};
  json["self"]["crossings"] = counted(r.crossings);
  json["body"]["crossings"] = counted(r.body_crossings);
  json["body"]["all_inside"] = counted(r.inside);
  json["body"]["all_depth_m"] = counted(r.inside_depth);
  json["body"]["gap"] = counted(r.body_gap);
  json["self"]["gap"] = counted(r.self_gap);
  return json_text(json);
}

std::string frame_line(const FrameReport& r, bool with_body) {
  char text[320];
  std::snprintf(text, sizeof text, "frame %lld: strain p50 %.2f%% p95 %.2f%% max %.2f%%; ",
                static_cast<long long>(r.frame), 100 * r.strain_p50, 100 * r.strain_p95,
                100 * r.strain_max);
  std::string line = text;
  if (with_body) {
    std::snprintf(text, sizeof text, "%d touch the body, %d just inside it (%.2f mm), ",
                  r.body_contacts, r.penetrating, 1e3 * r.penetration_depth);
    line += text;
  }
  std::snprintf(text, sizeof text, "%d touch cloth; energy %s J", r.self_contacts,
                number_text(r.kinetic_energy + r.elastic_energy).c_str());
  line += text;
  if (r.spring_residual >= 0) {
    std::snprintf(text, sizeof text, "; residual %s, %.2g rad",
                  length_text(r.spring_residual).c_str(), r.hinge_residual);
    line += text;
  }
  if (r.strain_residual >= 0) {
    std::snprintf(text, sizeof text, ", %.2g%% of strain", 100 * r.strain_residual);
    line += text;
  }
  if (r.crossings >= 0) {
    line += "; " + std::to_string(r.crossings) + " crossings with itself";
  }
  if (r.body_crossings >= 0) {
    std::snprintf(text, sizeof text, ", %d with the body; %d inside it, however deep (%.2f mm)",
                  r.body_crossings, r.inside, 1e3 * r.inside_depth);
    line += text;
  }
  const auto gap = [&](double share, const char* of) {
    if (share >= 0) {
      std::snprintf(text, sizeof text, "; least gap %.0f%% of the thickness kept from %s",
                    100 * share, of);
      line += text;
    }
  };
  gap(r.body_gap, "the body");
  gap(r.self_gap, "cloth");
  return line;
}

std::string garment_json(const std::string& name, const Garment& garment,
                         const ClothOptions& options) {
  const MembraneInUse membrane = membrane_in_use(garment, options);
  const BendingRigidity rigidity = bending_rigidity(garment);
  Material material = garment.material;
  Json said = {{"name", material.name}};
  for (const OptionField& field : describe(material).fields) {
    said[field.name] = *std::get<double*>(field.target);
  }
  Json of_garment = {{"vertices", garment.mesh.vertices.rows()},
                     {"faces", garment.mesh.faces.rows()},
                     {"material", said},
                     {"in_use", membrane_json(membrane)},
                     {"bending_by_direction", rigidity.by_direction}};
  if (!name.empty()) {
    of_garment["garment"] = name;
  }
  return json_text(of_garment);
}

std::string garment_words(const std::string& name, const Garment& garment,
                          const ClothOptions& options) {
  const MembraneInUse membrane = membrane_in_use(garment, options);
  const BendingRigidity rigidity = bending_rigidity(garment);
  char text[240];
  std::snprintf(text, sizeof text,
                "%lld vertices, %lld triangles; by direction their hinges are %.2f to %.2f of the "
                "fabric's bending stiffness (mean %.2f)",
                static_cast<long long>(garment.mesh.vertices.rows()),
                static_cast<long long>(garment.mesh.faces.rows()), rigidity.lowest,
                rigidity.highest, rigidity.mean);
  return (name.empty() ? "" : printable(name) + ": ") + text_of(membrane) + "\n" + text;
}

std::string stopped_words(Index done, Index count, const std::filesystem::path& out) {
  if (done == 0) {
    return "stopped before its first frame; nothing was written";
  }
  return "stopped after frame " + std::to_string(done) + " of " + std::to_string(count) + "; " +
         (done < count ? "it and the frames before it are in " : "all are in ") + out.string();
}

std::string kept_words(Index done, const std::filesystem::path& place) {
  return done == 0 ? ""
         : done == 1
             ? "; the frame before it is in " + place.string()
             : "; the " + std::to_string(done) + " frames before it are in " + place.string();
}

}  // namespace atelier
