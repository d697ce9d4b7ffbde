#include "apps/stages.h"

#include <array>

#include "apps/animate_stage.h"
#include "apps/appearance_stage.h"
#include "apps/body_stage.h"
#include "apps/flatten.h"
#include "apps/material_stage.h"
#include "apps/personalize_stage.h"
#include "apps/reconstruct_stage.h"
#include "apps/register_stage.h"
#include "apps/stage_command.h"
#include "apps/statistics_stage.h"
#include "apps/template_stage.h"
#include "apps/track_stage.h"
#ifdef ATELIER_HAS_CAPTURE
#include "apps/validate.h"
#include "apps/validate_stage.h"
#endif
#ifdef ATELIER_HAS_SIMULATION
#include "apps/simulate.h"
#endif
#ifdef ATELIER_HAS_CAPTURE
#include "capture/layouts/open_dataset.h"
#endif
#include "core/device.h"

namespace atelier {
namespace {

constexpr std::array kStages = {
    Stage{.name = "statistics",
          .version = 3,
          .summary = "statistics of a mesh sequence: counts, area, volume, bounds, edges, holes",
          .inputs = {"meshes"},
          .outputs = {"statistics"},
          .metrics = kStatisticsMetrics,
          .options = option_set<StatisticsStageOptions>,
          .run = run_statistics,
          .check_input = check_statistics_input,
          .frame_wise = true},
#ifdef ATELIER_HAS_CAPTURE
    Stage{.name = "validate",
          .version = 2,
          .summary = "defects of a capture, and how to correct them",
          .inputs = {"capture"},
          .outputs = {"findings"},
          .metrics = kValidateMetrics,
          .options = option_set<ValidateStageOptions>,
          .run = run_validate,
          .check_input = require_no_folder_above,
          .states_consent = true},
#endif
#ifdef ATELIER_HAS_CAPTURE_SURFACE
    Stage{.name = "reconstruct",
          .version = 5,
          .summary = "labelled surfaces and 3D keypoints from the images of a capture",
          .inputs = {"capture"},
          .outputs = {"scans", "keypoints3d"},
          .metrics = kReconstructMetrics,
          .options = option_set<ReconstructStageOptions>,
          .run = run_reconstruct,
          .check_input = require_no_folder_above,
          .frame_wise = true,
          .has_cuda = true,
          .device_keyed = true},
#endif
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING)
    Stage{.name = "personalize",
          .version = 7,
          .summary = "the person's body: shape, bone lengths and surface",
          .inputs = {"capture", "scans", "keypoints3d"},
          .outputs = {"person"},
          .metrics = kPersonalizeMetrics,
          .options = option_set<PersonalizeStageOptions>,
          .file_options = {"body"},
          .run = run_personalize,
          .check_input = require_no_folder_above},
    Stage{.name = "track",
          .version = 8,
          .summary = "the person's pose in every frame",
          .inputs = {"capture", "scans", "keypoints3d", "person"},
          .outputs = {"tracked"},
          .metrics = kTrackMetrics,
          .options = option_set<TrackStageOptions>,
          .file_options = {"region"},
          .run = run_track,
          .check_input = require_no_folder_above},
    Stage{.name = "body",
          .version = 4,
          .summary = "the body under the clothes in every frame",
          .inputs = {"capture", "scans", "person", "tracked"},
          .outputs = {"bodies"},
          .metrics = kBodyMetrics,
          .options = option_set<BodyStageOptions>,
          .run = run_body,
          .check_input = require_no_folder_above,
          .frame_wise = true},
#endif
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING) && \
    defined(ATELIER_HAS_REGISTRATION)
    Stage{.name = "template",
          .version = 8,
          .summary = "each garment as a clean mesh with named openings, in one frame's pose",
          .inputs = {"capture", "scans", "person", "bodies"},
          .outputs = {"template"},
          .metrics = kTemplateMetrics,
          .options = option_set<TemplateStageOptions>,
          .file_options = {"import"},
          .run = run_template,
          .check_input = require_no_folder_above},
#endif
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_REGISTRATION)
    Stage{.name = "register",
          .version = 10,
          .summary = "each garment's template registered to every frame",
          .inputs = {"capture", "template", "scans", "bodies"},
          .outputs = {"registered"},
          .metrics = kRegisterMetrics,
          .options = option_set<RegisterStageOptions>,
          .run = run_register,
          .check_input = require_no_folder_above,
          .frame_wise = true},
#endif
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING)
    Stage{.name = "refine",
          .version = 2,
          .summary = "the body again, under a registered garment instead of scans",
          .inputs = {"registered_garment", "scans", "person", "tracked", "bodies"},
          .outputs = {"refined_bodies"},
          .metrics = kBodyMetrics,
          .options = option_set<RefineStageOptions>,
          .run = run_refine,
          .check_input = check_refine_input,
          .frame_wise = true},
#endif
#ifdef ATELIER_HAS_REGISTRATION
    Stage{.name = "flatten",
          .version = 14,
          .summary = "a garment's surface as a flat sewing pattern",
          .inputs = {"surface"},
          .outputs = {"pattern"},
          .metrics = kFlattenMetrics,
          .options = option_set<FlattenStageOptions>,
          .file_options = {"seams", "relax.body", "relax.registered"},
          .run = run_flatten,
          .check_input = check_flatten_input},
#endif
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING) && \
    defined(ATELIER_HAS_REGISTRATION) && defined(ATELIER_HAS_SIMULATION) &&            \
    defined(ATELIER_HAS_CORE_RENDER)
    Stage{.name = "material",
          .version = 4,
          .summary = "stiffness of each garment's cloth, estimated from its motion",
          .inputs = {"capture", "person", "tracked", "bodies", "template", "registered"},
          .outputs = {"fitted_material"},
          .metrics = kMaterialMetrics,
          .options = option_set<MaterialStageOptions>,
          .run = run_material,
          .check_input = require_no_folder_above},
#endif
#if defined(ATELIER_HAS_SIMULATION) && defined(ATELIER_HAS_CORE_RENDER)
    Stage{.name = "simulate",
          .version = 8,
          .summary = "simulation of garments on a body at rest or in motion",
          .inputs = {"scene"},
          .outputs = {"states", "garment"},
          .metrics = kSimulateMetrics,
          .options = option_set<SimulateOptions>,
          .run = run_simulate,
          .check_input = check_simulate_input,
          .frame_wise = true,
          .has_cuda = true,
          .device_keyed = true},
#endif
#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_APPEARANCE)
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING) && \
    defined(ATELIER_HAS_REGISTRATION)
    Stage{.name = "appearance",
          .version = 10,
          .summary = "appearance of each garment: networks that generate its texture",
          .inputs = {"capture", "registered", "bodies"},
          .outputs = {"networks"},
          .metrics = kAppearanceMetrics,
          .options = option_set<AppearanceStageOptions>,
          .run = run_appearance,
          .check_input = require_no_folder_above,
          .has_cuda = true,
          .device_keyed = true},
#endif
    Stage{
        .name = "ceiling",
        .version = 9,
        .summary = "appearance on the ground-truth geometry of a synthetic capture, for comparison",
        .inputs = {"capture"},
        .outputs = {"true_networks"},
        .metrics = kAppearanceMetrics,
        .options = option_set<AppearanceStageOptions>,
        .run = run_ceiling,
        .check_input = require_no_folder_above,
        .has_cuda = true,
        .device_keyed = true},
#endif
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING) && \
    defined(ATELIER_HAS_REGISTRATION) && defined(ATELIER_HAS_SIMULATION) &&            \
    defined(ATELIER_HAS_CORE_RENDER)
    Stage{.name = "animate",
          .version = 6,
          .summary = "the person and the simulated garments in a motion, as meshes and images",
          .inputs = {"capture", "person", "tracked"},
          .optional_inputs = {"bodies", "template", "registered", "fitted_material", "networks"},
          .outputs = {"animation"},
          .metrics = kAnimateMetrics,
          .options = option_set<AnimateOptions>,
          .file_options = {"motion", "body", "garment", "cloth_sequence"},
          .run = run_animate,
          .check_input = require_no_folder_above,
          .frame_wise = true,
          .has_cuda = true,
          .device_keyed = true},
#endif
};

#if defined(ATELIER_HAS_SIMULATION) && defined(ATELIER_HAS_CORE_RENDER)
constexpr std::array kSimulateFlags = {
    StandAlone::Flag{"garment", "MESH",
                     "Without a workspace: garment to simulate, a mesh or garment.h5; several "
                     "layers joined by +, innermost first"},
    StandAlone::Flag{"body", "FILE",
                     "Body: a mesh, a folder of meshes (one for each frame), a sequence, a body "
                     "model, female or male"},
    StandAlone::Flag{"motion", "FILE",
                     "Motion of a body model: .bvh, .amc, .npz, .trc, .c3d, .glb"},
    StandAlone::Flag{"out", "FOLDER|FILE",
                     "Folder for frames, images and videos, each frame written once it is done; or "
                     "one file (.h5 or .usda) for all frames, with images and videos beside it"},
    StandAlone::Flag{"format", "h5|ply|obj|usda", "Format of the frames in a folder [h5]"},
    StandAlone::Flag{"material", "NAME", "Fabric, the same as --material.name"},
    StandAlone::Flag{
        "grid", "",
        "Grid over bending and stretching stiffness, written as grid.png instead of frames"},
    StandAlone::Flag{"no-pictures", "", "No sheet.png, turntable.mp4 and motion.mp4"},
};
constexpr StandAlone kSimulateAlone{kSimulateFlags, simulate_alone};
#endif

#ifdef ATELIER_HAS_REGISTRATION
constexpr std::array kFlattenFlags = {
    StandAlone::Flag{"mesh", "MESH", "Without a workspace: surface of the garment"},
    StandAlone::Flag{"out", "FOLDER",
                     "New folder for pattern.svg, pattern.dxf, garment.obj and stretch.png"},
    StandAlone::Flag{"no-pictures", "", "No stretch.png"},
};
constexpr StandAlone kFlattenAlone{kFlattenFlags, flatten_alone};
#endif

#ifdef ATELIER_HAS_CAPTURE
constexpr std::array kValidateFlags = {
    StandAlone::Flag{"html", "FILE",
                     "Without a workspace: HTML page to write, with contact sheets, camera layout "
                     "and error plots"},
};
constexpr StandAlone kValidateAlone{kValidateFlags, validate_alone, true};
#endif

}  // namespace

std::span<const Stage> all_stages() {
  return kStages;
}

void require_startable([[maybe_unused]] const Stage& stage, const StageRequest& request) {
  check_device(request.device);
#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_APPEARANCE)
  if (stage.name == "appearance" || stage.name == "ceiling") {
    const auto& options = options_of<AppearanceStageOptions>(request.options);
    require_trainable(options, request.device);
    require_cameras(options, request.input);
  }
#endif
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_REGISTRATION)
  if (stage.name == "register" && !request.workspace.empty()) {
    require_registered_frames(options_of<RegisterStageOptions>(request.options), request.selection,
                              request.input, request.workspace);
  }
#endif
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING)
  if (stage.name == "personalize") {
    require_measurable(options_of<PersonalizeStageOptions>(request.options), request.input,
                       request.workspace);
  }
  if (stage.name == "track") {
    require_trackable(options_of<TrackStageOptions>(request.options), request.workspace);
  }
  if (stage.name == "refine" && !request.workspace.empty()) {
    require_garment(request.input, request.workspace);
  }
#endif
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING) && \
    defined(ATELIER_HAS_REGISTRATION)
  if (stage.name == "template") {
    require_named(options_of<TemplateStageOptions>(request.options));
    require_template_frame(options_of<TemplateStageOptions>(request.options), request.input);
  }
#endif
#ifdef ATELIER_HAS_REGISTRATION
  if (stage.name == "flatten") {
    require_named(options_of<FlattenStageOptions>(request.options), request.input);
  }
#endif
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING) && \
    defined(ATELIER_HAS_REGISTRATION) && defined(ATELIER_HAS_SIMULATION) &&            \
    defined(ATELIER_HAS_CORE_RENDER)
  if (stage.name == "animate") {
    require_named(options_of<AnimateOptions>(request.options), request.input);
  }
#endif
}

const StandAlone* stand_alone([[maybe_unused]] std::string_view stage) {
#if defined(ATELIER_HAS_SIMULATION) && defined(ATELIER_HAS_CORE_RENDER)
  if (stage == "simulate") {
    return &kSimulateAlone;
  }
#endif
#ifdef ATELIER_HAS_REGISTRATION
  if (stage == "flatten") {
    return &kFlattenAlone;
  }
#endif
#ifdef ATELIER_HAS_CAPTURE
  if (stage == "validate") {
    return &kValidateAlone;
  }
#endif
  return nullptr;
}

}  // namespace atelier
