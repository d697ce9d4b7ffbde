#include "appearance/learnt_occlusion.h"

#include <cstddef>

#include "core/error.h"

namespace atelier {
namespace {

constexpr const char* kOcclusionText = "occlusion.";

/// With what is left open taken from others.
OcclusionOptions filled(const OcclusionOptions& asked, const OcclusionOptions& from) {
  return {asked.strata > 0 ? asked.strata : from.strata, asked.reach > 0 ? asked.reach : from.reach,
          asked.offset >= 0 ? asked.offset : from.offset};
}

}  // namespace

void put_occlusion(std::map<std::string, std::string>& texts,
                   const std::optional<OcclusionOptions>& occlusion) {
  if (occlusion) {
    OcclusionOptions options = *occlusion;
    for (const OptionField& field : describe(options).fields) {
      texts[kOcclusionText + field.name] = option_text(field);
    }
  }
}

std::optional<OcclusionOptions> occlusion_at(const std::map<std::string, std::string>& texts,
                                             const std::string& file) {
  OcclusionOptions options;
  OptionTable table = describe(options);
  std::size_t found = 0;
  std::string missing;
  for (const OptionField& field : describe(options).fields) {
    const auto text = texts.find(kOcclusionText + field.name);
    if (text == texts.end()) {
      missing = kOcclusionText + field.name;
      continue;
    }
    ++found;
    if (const std::string wrong = set_option(table, field.name, text->second); !wrong.empty()) {
      throw DataError(file, text->first, wrong, "how light was measured");
    }
  }
  if (found == 0) {
    return std::nullopt;
  }
  if (!missing.empty()) {
    throw DataError(file, missing, "nothing", "a number, as there is of the others");
  }
  return options;
}

OptionTable describe_open(OcclusionOptions& options) {
  OptionTable table;
  table.add("strata", options.strata, 0, 32, "",
            "Square root of the number of occlusion rays of a vertex; 0: as in training");
  table.add("reach", options.reach, 0, 100, "m",
            "Distance beyond which geometry does not occlude; 0: as in training");
  table.add("offset", options.offset, -1, 0.1, "m",
            "Distance from the surface at which occlusion rays start; below 0: as in training");
  return table;
}

std::string occlusion_problem(const OcclusionOptions& asked, const LearntOcclusion& learnt) {
  if (!learnt.occlusion) {
    return "";
  }
  OcclusionOptions has = *learnt.occlusion;
  OcclusionOptions wanted = filled(asked, has);
  const OptionTable has_table = describe(has);
  const OptionTable wanted_table = describe(wanted);
  for (std::size_t i = 0; i < has_table.fields.size(); ++i) {
    const std::string one = option_text(wanted_table.fields[i]);
    const std::string other = option_text(has_table.fields[i]);
    if (one != other) {
      std::string problem = kOcclusionText + has_table.fields[i].name;
      problem += " cannot be " + one;
      problem += ": " + learnt.name;
      problem += " learnt with " + other;
      return problem;
    }
  }
  return "";
}

OcclusionOptions drawn_occlusion(const OcclusionOptions& asked,
                                 const std::vector<LearntOcclusion>& learnt) {
  OcclusionOptions known = asked;
  for (const LearntOcclusion& one : learnt) {
    if (const std::string problem = occlusion_problem(known, one); !problem.empty()) {
      throw DataError("", "light", problem,
                      "networks that learnt alike, and nothing else asked for");
    }
    known = one.occlusion ? *one.occlusion : known;
  }
  return filled(known, {});
}

}  // namespace atelier
