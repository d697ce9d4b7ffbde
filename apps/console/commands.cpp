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
    Command{"status", "what a workspace holds, and in which state", add_status},
#ifdef ATELIER_COMMAND_INSPECT
    Command{"inspect", "what a file is: sizes, ranges, units, findings", add_inspect},
#endif
    Command{"gc", "remove unfinished work and results that are no longer current", add_gc},
    Command{"convert", "a mesh into another format", add_convert, convert_options},
#ifdef ATELIER_COMMAND_RENDER
    Command{"render", "a picture of a mesh", add_render, render_options},
#endif
#ifdef ATELIER_COMMAND_BODY_MODEL
    Command{"body-model", "show, measure, convert and pose a body", add_body_model, body_model_options},
#endif
#ifdef ATELIER_COMMAND_DRAPE
    Command{"drape", "sew a garment from its pattern on the default body", add_drape, drape_options},
#endif
#ifdef ATELIER_COMMAND_SYNTHESIZE
    Command{"synthesize", "a capture of a clothed person, with the truth behind it", add_synthesize, synthesize_options},
#endif
#ifdef ATELIER_COMMAND_CONVERT_CAPTURE
    Command{"convert-capture", "a capture into another layout: any of those that are read", add_convert_capture, convert_capture_options},
#endif
#ifdef ATELIER_COMMAND_CALIBRATE
    Command{"calibrate", "cameras from pictures of a board: lenses, poses, how sure they are", add_calibrate, calibrate_options},
#endif
#ifdef ATELIER_COMMAND_CALIBRATE_COLOR
    Command{"calibrate-color", "gain and white balance between the cameras of a capture", add_calibrate_color, calibrate_color_options},
#endif
#ifdef ATELIER_COMMAND_MASKS
    Command{"masks", "who is in the pictures: from plates, a coloured screen, or over time", add_masks, masks_options},
#endif
#ifdef ATELIER_COMMAND_DEPTH
    Command{"depth", "depth maps of a frame, of some views or all, also for COLMAP", add_depth, depth_options},
#endif
#ifdef ATELIER_COMMAND_DETECT
    Command{"detect", "keypoints or labels of pictures by a network of your own (ONNX)", add_detect, detect_options},
#endif
#ifdef ATELIER_COMMAND_DRAW
    Command{"draw", "a dressed person in motion, by the networks of the stage appearance", add_draw, draw_options},
#endif
#ifdef ATELIER_COMMAND_EVALUATE
    Command{"evaluate", "results against the truth of a synthetic capture", add_evaluate},
#endif
#ifdef ATELIER_COMMAND_EXPORT
    Command{"export", "results of a workspace as files that other programs open", add_export, export_options},
#endif
#ifdef ATELIER_COMMAND_REPORT
    Command{"report", "one HTML page on a workspace: warnings, figures, pictures", add_report, report_options},
#endif
    Command{"options", "every option of every stage and command", add_options},
#ifdef ATELIER_COMMAND_COMPLETION
    Command{"completion", "a completion script for bash", add_completion},
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
};

}  // namespace

std::span<const Command> all_commands() {
  return kCommands;
}

std::span<const StandAlone> all_stand_alone() {
  return kStandAlone;
}

}  // namespace atelier
