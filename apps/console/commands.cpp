#include <array>
#include <vector>

#include "apps/console/command.h"
#include "apps/console/stand_alone.h"

namespace atelier {
namespace {

constexpr std::array kCommands = {
#ifdef ATELIER_COMMAND_RUN
    Command{"run", "every stage of a capture, from its images to the report", add_run},
#endif
#ifdef ATELIER_COMMAND_PLAN
    Command{"plan", "a run as jobs for several machines: what each reads, needs and takes",
            add_plan},
#endif
    Command{"status", "results in a workspace and their state", add_status},
#ifdef ATELIER_COMMAND_INSPECT
    Command{"inspect", "contents of a file: sizes, ranges, units, findings", add_inspect},
#endif
    Command{"gc", "removal of unfinished work and of results that are no longer current", add_gc},
    Command{"convert", "conversion of a mesh to another format", add_convert, convert_options},
#ifdef ATELIER_COMMAND_RENDER
    Command{"render", "an image of a mesh", add_render, render_options},
#endif
#ifdef ATELIER_COMMAND_BODY_MODEL
    Command{"body-model", "images, measurements, conversion and posing of a body", add_body_model,
            body_model_options},
#endif
#ifdef ATELIER_COMMAND_DRAPE
    Command{"drape", "a garment sewn from its pattern and draped on the default body", add_drape,
            drape_options},
#endif
#ifdef ATELIER_COMMAND_SYNTHESIZE
    Command{"synthesize", "a synthetic capture of a clothed person, with its ground truth",
            add_synthesize, synthesize_options},
#endif
#ifdef ATELIER_COMMAND_CONVERT_CAPTURE
    Command{"convert-capture", "conversion of a capture to another layout", add_convert_capture,
            convert_capture_options},
#endif
#ifdef ATELIER_COMMAND_CALIBRATE
    Command{"calibrate",
            "camera calibration from images of a board: lenses, poses and their accuracy",
            add_calibrate, calibrate_options},
#endif
#ifdef ATELIER_COMMAND_CALIBRATE_COLOR
    Command{"calibrate-color", "gain and white balance between the cameras of a capture",
            add_calibrate_color, calibrate_color_options},
#endif
#ifdef ATELIER_COMMAND_MASKS
    Command{"masks", "segmentation of the person: by clean plates, a coloured screen, or over time",
            add_masks, masks_options},
#endif
#ifdef ATELIER_COMMAND_DEPTH
    Command{"depth", "depth maps of one frame, of some or all views, also for COLMAP", add_depth,
            depth_options},
#endif
#ifdef ATELIER_COMMAND_DETECT
    Command{"detect",
            "keypoints or labels of images by the built-in networks or one of your own (ONNX)",
            add_detect, detect_options},
#endif
#ifdef ATELIER_COMMAND_DRAW
    Command{"render-neural",
            "render --neural: images of a clothed person by the networks of the stage appearance",
            add_draw, draw_options},
#endif
#ifdef ATELIER_COMMAND_EVALUATE
    Command{"evaluate", "evaluation of results against the ground truth of a synthetic capture",
            add_evaluate},
#endif
#ifdef ATELIER_COMMAND_EXPORT
    Command{"export", "export of a workspace's results to files for other programs", add_export,
            export_options},
#endif
#ifdef ATELIER_COMMAND_REPORT
    Command{"report", "one HTML page on a workspace: warnings, figures, images", add_report,
            report_options},
#endif
#ifdef ATELIER_COMMAND_VIEW
    Command{"view",
            "a workspace, capture or mesh in the browser: in 3D, over time, from its cameras",
            add_view, view_options},
#endif
#ifdef ATELIER_COMMAND_KEY
    Command{"key", "a key pair of one to whom is sealed", add_key},
#endif
#ifdef ATELIER_COMMAND_SEAL
    Command{"seal", "a workspace or an export in one file that recipients alone can open", add_seal,
            seal_options},
#endif
#ifdef ATELIER_COMMAND_SIGN
    Command{"sign", "a signature under the consent of a capture", add_sign},
#endif
#ifdef ATELIER_COMMAND_UNSEAL
    Command{"unseal", "what a sealed file holds, in a new folder", add_unseal},
#endif
#ifdef ATELIER_COMMAND_VERIFY
    Command{"verify", "who may open a file, who has consented to what, and who used it", add_verify,
            verify_options},
#endif
    Command{"options", "list of all options of all stages and commands", add_options},
#ifdef ATELIER_COMMAND_COMPLETION
    Command{"completion", "completion script for bash", add_completion},
#endif
};

const std::vector<StandAlone> kStandAlone = {
#ifdef ATELIER_COMMAND_VALIDATE_ALONE
    {"validate", "--html", true, add_validate_alone},
#endif
#ifdef ATELIER_COMMAND_FLATTEN_ALONE
    {"flatten", "--mesh", false, add_flatten_alone},
#endif
#ifdef ATELIER_COMMAND_SIMULATE_ALONE
    {"simulate", "--garment", false, add_simulate_alone},
#endif
#ifdef ATELIER_COMMAND_ANIMATE_SEALED
    {"animate", "--identity", false, add_animate_sealed, true},
#endif
};

}  // namespace

std::span<const Command> all_commands() {
  return kCommands;
}

std::string_view commands_left_out() {
  return ATELIER_COMMANDS_LEFT_OUT;
}

std::span<const StandAlone> all_stand_alone() {
  return kStandAlone;
}

}  // namespace atelier
