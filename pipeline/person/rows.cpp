#include "capture/layouts/open_dataset.h"
#include "pipeline/person/body_stage.h"
#include "pipeline/person/personalize_stage.h"
#include "pipeline/person/track_stage.h"
#include "pipeline/row/stage_row.h"

namespace atelier {

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
                .check_input = require_no_folder_above},
      .require_startable =
          [](const StageRequest& request) {
            require_measurable(options_of<PersonalizeStageOptions>(request.options), request.input,
                               request.workspace);
          },
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
                .check_input = require_no_folder_above},
      .require_startable =
          [](const StageRequest& request) {
            require_trackable(options_of<TrackStageOptions>(request.options), request.workspace);
          },
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
                .check_input = require_no_folder_above,
                .frame_wise = true},
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
      .after = "register",
      .require_startable =
          [](const StageRequest& request) {
            if (!request.workspace.empty()) {
              require_garment(request.input, request.workspace);
            }
          },
  };
  return row;
}

}  // namespace atelier
