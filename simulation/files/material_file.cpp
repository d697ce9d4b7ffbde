#include "simulation/files/material_file.h"

#include <cmath>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/json.h"
#include "core/io/json_place.h"

namespace atelier {
namespace {

nlohmann::ordered_json json_of(const StiffnessRange& range) {
  return {{"low", range.low},
          {"high", range.high},
          {"open_low", range.open_low},
          {"open_high", range.open_high}};
}

nlohmann::ordered_json json_of(const Stiffness& stiffness) {
  return {{"stretch", stiffness.stretch}, {"bending", stiffness.bending}};
}

nlohmann::ordered_json json_of(const Material& material) {
  Material copy = material;
  nlohmann::ordered_json json = {{"name", copy.name}};
  for (const OptionField& field : describe(copy).fields) {
    json[field.name] = *std::get<double*>(field.target);
  }
  return json;
}

nlohmann::ordered_json json_of(const StiffnessTrial& trial) {
  nlohmann::ordered_json json = json_of(trial.stiffness);
  json["distance"] = std::isfinite(trial.distance) ? nlohmann::ordered_json(trial.distance)
                                                   : nlohmann::ordered_json(nullptr);
  return json;
}

Stiffness stiffness_at(const JsonPlace& place) {
  const Stiffness stiffness{place.at("stretch").number(), place.at("bending").number()};
  if (!(stiffness.stretch >= 0 && stiffness.bending >= 0)) {
    place.fail("a stiffness below 0", "N/m and N m, at least 0");
  }
  return stiffness;
}

}  // namespace

std::string number_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, value >= 1000 ? "%.0f" : "%.3g", value);
  return text;
}

std::string range_text(const StiffnessRange& range) {
  return number_text(range.low) + (range.open_low ? " or less" : "") + " to " +
         number_text(range.high) + (range.open_high ? " or more" : "");
}

std::string materials_text(const std::vector<GarmentMaterial>& garments) {
  nlohmann::ordered_json all;
  all["garments"] = nlohmann::ordered_json::object();
  for (const GarmentMaterial& one : garments) {
    nlohmann::ordered_json& json = all["garments"][one.garment];
    if (one.fit) {
      json["distance"] = one.fit->distance;
      json["nearest"] = json_of(one.fit->best);
      json["credible_low"] = json_of(one.fit->credible_low);
      json["credible_high"] = json_of(one.fit->credible_high);
      json["stretch_range"] = json_of(one.fit->stretch);
      json["bending_range"] = json_of(one.fit->bending);
      json["stretch_within_tenth"] =
          json_of(range_within(one.fit->trials, kTenth, &Stiffness::stretch));
      json["bending_within_tenth"] =
          json_of(range_within(one.fit->trials, kTenth, &Stiffness::bending));
      for (const StiffnessTrial& trial : one.fit->trials) {
        json["trials"].push_back(json_of(trial));
      }
    }
    json["material"] = json_of(one.material);
  }
  return all.dump(1);
}

std::map<std::string, FoundMaterial> parse_materials(std::string_view text,
                                                     const std::string& file) {
  const nlohmann::json parsed = parse_json(text, file);
  const JsonPlace all = JsonPlace(parsed, file).at("garments");
  std::map<std::string, FoundMaterial> materials;
  for (const auto& [name, json] : parsed.at("garments").items()) {
    const JsonPlace place = all.at(name).at("material");
    Material material;
    material.name = place.at("name").text();
    OptionTable table = describe(material);
    for (const OptionField& field : table.fields) {
      *std::get<double*>(field.target) = place.at(field.name).number();
    }
    const std::vector<std::string> problems = check_options(table);
    if (!problems.empty()) {
      throw DataError(file, name, problems.front(), "a material in its ranges");
    }
    FoundMaterial& found = materials[name];
    found.material = material;
    // Neither where the material was given; "likely" in files of the release before.
    const std::string interval = all.at(name).has("likely_low") ? "likely" : "credible";
    if (all.at(name).has(interval + "_low")) {
      found.credible_low = stiffness_at(all.at(name).at(interval + "_low"));
      found.credible_high = stiffness_at(all.at(name).at(interval + "_high"));
    }
    for (const JsonPlace& trial : all.at(name).items("trials")) {
      const double distance = trial.at("distance").value().is_null()
                                  ? std::numeric_limits<double>::infinity()  // it flew apart
                                  : trial.at("distance").number();
      found.trials.push_back({stiffness_at(trial), distance});
    }
  }
  return materials;
}

std::map<std::string, FoundMaterial> read_materials(const std::filesystem::path& result) {
  const std::filesystem::path file = result / "material.json";
  return parse_materials(read_file_text(file, Limits().text_file_bytes), file.string());
}

}  // namespace atelier
