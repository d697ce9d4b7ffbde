#include "core/renamed_options.h"

#include <algorithm>
#include <array>

namespace atelier {
namespace {

struct Renamed {
  std::string_view before;  ///< the last words of a name
  std::string_view now;
};

/// The one list of former names of options; a row goes a release after it came.
constexpr std::array kOptions = {
    Renamed{"least_confidence", "min_confidence"},
    Renamed{"least_views", "min_views"},
    Renamed{"least_share", "min_share"},
    Renamed{"least_piece", "min_component_area"},
    Renamed{"least_points", "min_points"},
    Renamed{"least_frames", "min_frames"},
    Renamed{"least_rejected", "min_rejected"},
    Renamed{"least_difference", "min_difference"},
    Renamed{"least_part", "min_part"},
    Renamed{"largest_hole", "max_hole"},
    Renamed{"largest_deviation", "max_focal_deviation"},
    Renamed{"most_points", "max_points"},
    Renamed{"most_frames", "max_frames"},
    Renamed{"most_views", "max_views"},
    Renamed{"labels.steepest", "labels.max_view_angle"},
    Renamed{"samples.steepest", "samples.max_view_angle"},
    Renamed{"hull.cell", "hull.voxel_size"},
    Renamed{"hull.reach", "hull.half_extent"},
    Renamed{"equalize", "exposure_compensation"},
    Renamed{"way", "method"},
    Renamed{"deviation", "standard_deviation"},
    Renamed{"give", "tolerance"},
    Renamed{"find.sides", "find.front_back_cost"},
    Renamed{"hold", "body_prior"},
    Renamed{"leash", "tracking_rate"},
    Renamed{"usual", "use_prior"},
    Renamed{"search.band", "search.likelihood_width"},
    Renamed{"truth_scans", "ground_truth_scans"},
    Renamed{"truth_images", "ground_truth_images"},
    Renamed{"truth_maps", "ground_truth_maps"},
};

/// Options of the cloth that every solver understands, which had the name of one before theirs.
constexpr std::array<std::string_view, 2> kSolverSections = {"xpbd.", "projective_friction."};
constexpr std::array<std::string_view, 14> kOfEverySolver = {"time_step",
                                                             "friction",
                                                             "thickness",
                                                             "contact_reach",
                                                             "depenetration_speed",
                                                             "self_contact",
                                                             "self_thickness",
                                                             "self_friction",
                                                             "air_density",
                                                             "drag",
                                                             "lift",
                                                             "velocity_damping",
                                                             "report",
                                                             "intersection_interval"};

/// The same of the values of choices.
constexpr std::array kChoices = {
    Renamed{"ceiling", "oracle"},
    Renamed{"truth", "ground_truth"},
};

/// The same of stages, whose names are also sections of options and folders of a workspace, and of
/// commands.
constexpr std::array kStages = {
    Renamed{"ceiling", "oracle"},
    Renamed{"draw", "render-neural"},
};

/// The same of figures in manifests.
constexpr std::array kMetrics = {
    Renamed{"truth_scans", "ground_truth_scans"},
    Renamed{"gave_way_mean", "deviation_mean"},
    Renamed{"gave_way_most", "deviation_max"},
};

/// Whether a dotted name ends with these whole words.
bool ends_with_words(std::string_view name, std::string_view words) {
  return name.ends_with(words) &&
         (name.size() == words.size() || name[name.size() - words.size() - 1] == '.');
}

/// The name with its last words renamed; "" if it does not end with them.
std::string with_end(std::string_view name, const Renamed& row) {
  if (!ends_with_words(name, row.before)) {
    return "";
  }
  return std::string(name.substr(0, name.size() - row.before.size())) + std::string(row.now);
}

bool is_known(const std::vector<std::string>& known, const std::string& name) {
  return std::find(known.begin(), known.end(), name) != known.end();
}

}  // namespace

std::string renamed_option(std::string_view name, const std::vector<std::string>& known) {
  const std::string_view section = name.substr(0, name.find('.'));
  if (const std::string stage = renamed_stage(section);
      !stage.empty() && section.size() < name.size()) {
    const std::string now = stage + std::string(name.substr(section.size()));
    return is_known(known, now) ? now : renamed_option(now, known);
  }
  for (const Renamed& row : kOptions) {
    if (const std::string now = with_end(name, row); is_known(known, now)) {
      return now;
    }
  }
  for (const std::string_view solver : kSolverSections) {
    for (const std::string_view option : kOfEverySolver) {
      const std::string before = std::string(solver) + std::string(option);
      if (const std::string now = with_end(name, {before, option}); is_known(known, now)) {
        return now;
      }
    }
  }
  return "";
}

std::string renamed_choice(std::string_view value, const std::vector<std::string>& choices) {
  for (const Renamed& row : kChoices) {
    if (value == row.before && is_known(choices, std::string(row.now))) {
      return std::string(row.now);
    }
  }
  return "";
}

std::string renamed_stage(std::string_view name) {
  for (const Renamed& row : kStages) {
    if (name == row.before) {
      return std::string(row.now);
    }
  }
  return "";
}

std::string present_metric(std::string_view name) {
  for (const Renamed& row : kMetrics) {
    if (name == row.before) {
      return std::string(row.now);
    }
  }
  return std::string(name);
}

std::string former_stage(std::string_view name) {
  for (const Renamed& row : kStages) {
    if (name == row.now) {
      return std::string(row.before);
    }
  }
  return "";
}

}  // namespace atelier
