#include <array>

#include "capture/layouts/capture_lacks.h"
#include "capture/layouts/open_dataset.h"
#include "pipeline/person/body_measures.h"
#include "pipeline/person/body_pictures.h"
#include "pipeline/person/body_stage.h"
#include "pipeline/person/person_measures.h"
#include "pipeline/person/person_rules.h"
#include "pipeline/person/personalize_stage.h"
#include "pipeline/person/track_pictures.h"
#include "pipeline/person/track_stage.h"
#include "pipeline/row/stage_row.h"

namespace atelier {
namespace {

using enum Measure::Side;

constexpr const char* kNotDynamic =
    "a tenth of the body's vertices or less lie under ground-truth clothing that swings "
    "(track.dynamic_share), so that there is little to leave out";
constexpr const char* kNoLabel =
    "a tenth of the body's vertices or less lie under ground-truth clothing that swings "
    "(track.dynamic_share), or no ground-truth garment has a label of --input.excluded";

constexpr std::array kPersonalizeTargets = {
    Target{"personal.mean_mm", "distance of the person's body at rest from the true one", "mm",
           AtMost, 3, 7},
};

constexpr std::array kTrackTargets = {
    Target{"track.mean_mm", "distance of the tracked joints from the true ones", "mm", AtMost, 6,
           10},
    Target{"track.legs_mm", "distance of hips, knees and ankles from the true ones", "mm", AtMost,
           10, 12},
    Target{"track.legs_ratio", "error of the legs without swinging clothes, over that with them",
           "", AtMost, 0.5, 1.1, kNotDynamic},
    Target{"track.auto_ratio",
           "error of the legs where swinging clothes are found, over that where they are given", "",
           AtMost, 1.2, 1.3, kNoLabel},
};

constexpr std::array kBodyTargets = {
    Target{"body.mean_mm", "distance of the body under the clothes from the true one", "mm", AtMost,
           5, 8},
    Target{"body.covered_mean_mm", "distance of the covered skin from the true skin", "mm", AtMost,
           8, 10},
    Target{"body.outside_rate", "share of the covered skin outside the true clothes", "", AtMost,
           0.03, 0.03},
    Target{"body.outside_depth_mm", "mean depth of skin outside the true clothes", "mm", AtMost, 1,
           8},
    Target{"body.proximity_mm", "error of the gap between skin and close clothes", "mm", AtMost,
           1.5, 6},
};

constexpr std::array kRefineTargets = {
    Target{"refine.mean_mm", "distance of the refined body from the true one", "mm", AtMost, 5, 8},
    Target{"refine.covered_mean_mm",
           "distance of the refined body's covered skin from the true skin", "mm", AtMost, 8, 10},
    Target{"refine.outside_rate",
           "share of the refined body's covered skin outside the true clothes", "", AtMost, 0.03,
           0.03},
    Target{"refine.outside_depth_mm",
           "mean depth of the refined body's skin outside the true clothes", "mm", AtMost, 1, 8},
    Target{"refine.proximity_mm", "error of the gap between the refined body and close clothes",
           "mm", AtMost, 1.5, 6},
};

constexpr std::array kPersonalizeFigures = {
    KeyFigure{"keypoint_rms", "distance of the person's body from the keypoints, rms",
              Measure::Side::AtMost, 0.015},
    KeyFigure{"scan_rms", "distance of the person's body from the scans, rms",
              Measure::Side::AtMost, 0.006},
};

}  // namespace

const StageRow& personalize_row() {
  static const StageRow row{
      .stage = {.name = "personalize",
                .version = 7,
                .summary = "the person's body: shape, bone lengths and surface",
                .inputs = {"capture", "scans", "keypoints3d"},
                .outputs = {"person"},
                .metrics = kPersonalizeMetrics,
                .options = option_set<PersonalizeStageOptions>,
                .file_options = {"body"},
                .run = run_personalize,
                .check_input = check_capture_input},
      .input_help = "Capture of the person; best with a minimally clothed sequence",
      .require_startable =
          [](const StageRequest& request) {
            require_measurable(options_of<PersonalizeStageOptions>(request.options), request.input,
                               request.workspace);
          },
      .chain = ChainPlace{.lacks = lacks_keypoints,
                          .cost = {.seconds = 1, .per_picture = 0.28},
                          .report_cost = {.seconds = 0.3},
                          .truth_cost = {.seconds = 1}},
      .measure = measure_personalize,
      .problem = personalize_problem,
      .targets = kPersonalizeTargets,
      .key_figures = kPersonalizeFigures,
      .rules = &person_rules(),
  };
  return row;
}

const StageRow& track_row() {
  static const StageRow row{
      .stage = {.name = "track",
                .version = 8,
                .summary = "the person's pose in every frame",
                .inputs = {"capture", "scans", "keypoints3d", "person"},
                .outputs = {"tracked"},
                .metrics = kTrackMetrics,
                .options = option_set<TrackStageOptions>,
                .file_options = {"region"},
                .run = run_track,
                .check_input = check_capture_input},
      .input_help = "Capture of the person, of which WORKSPACE has the keypoints and scans",
      .require_startable =
          [](const StageRequest& request) {
            require_trackable(options_of<TrackStageOptions>(request.options), request.workspace);
          },
      .chain = ChainPlace{.lacks = lacks_keypoints,
                          .cost = {.seconds = 0.3, .per_frame = 0.32},
                          .report_cost = {.seconds = 0.5, .per_picture = 0.03},
                          .truth_cost = {.seconds = 1}},
      .measure = measure_track,
      .problem = track_problem,
      .targets = kTrackTargets,
      .key_figures = kTrackFigures,
      .rules = &person_rules(),
      .pictures = track_pictures,
  };
  return row;
}

const StageRow& body_row() {
  static const StageRow row{
      .stage = {.name = "body",
                .version = 4,
                .summary = "the body under the clothes in every frame",
                .inputs = {"capture", "scans", "person", "tracked"},
                .outputs = {"bodies"},
                .metrics = kBodyMetrics,
                .options = option_set<BodyStageOptions>,
                .run = run_body,
                .check_input = check_capture_input,
                .frame_wise = true},
      .input_help = "Capture of the person, of which WORKSPACE has the scans and poses",
      .chain = ChainPlace{.lacks = lacks_masks,
                          .splits = true,
                          .cost = {.per_frame = 3.1, .parallel = true},
                          .report_cost = {.seconds = 0.8},
                          .truth_cost = {.per_clothed = 0.07}},
      .measure = measure_body,
      .measure_place = 1,
      .targets = kBodyTargets,
      .key_figures = kBodyFigures,
      .rules = &body_rules(),
      .pictures = body_pictures,
  };
  return row;
}

const StageRow& refine_row() {
  static const StageRow row{
      .stage = {.name = "refine",
                .version = 2,
                .summary = "the body again, under a registered garment instead of scans",
                .inputs = {"registered_garment", "scans", "person", "tracked", "bodies"},
                .outputs = {"refined_bodies"},
                .metrics = kBodyMetrics,
                .options = option_set<RefineStageOptions>,
                .run = run_refine,
                .check_input = check_refine_input,
                .frame_wise = true},
      .input_help = "Registered garment: WORKSPACE/register/current, or a folder of that form",
      .after = "register",
      .require_startable =
          [](const StageRequest& request) {
            if (!request.workspace.empty()) {
              require_garment(request.input, request.workspace);
            }
          },
      .measure = measure_refine,
      .measure_place = 1,
      .targets = kRefineTargets,
      .rules = &body_rules(),
  };
  return row;
}

}  // namespace atelier
