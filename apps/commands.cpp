#include <array>

#include "apps/command.h"

namespace atelier {
namespace {

constexpr std::array kCommands = {
#ifdef ATELIER_HAS_CAPTURE
    Command{"run", "every stage of a capture, from its images to the report", add_run},
#endif
    Command{"status", "what a workspace holds, and in which state", add_status},
    Command{"inspect", "what a file is: sizes, ranges, units, findings", add_inspect},
    Command{"gc", "remove unfinished work and results that are no longer current", add_gc},
    Command{"convert", "a mesh into another format", add_convert, convert_options},
#ifdef ATELIER_HAS_CORE_RENDER
    Command{"render", "a picture of a mesh", add_render, render_options},
#ifdef ATELIER_HAS_BODYMODEL
    Command{"body-model", "show, measure, convert and pose a body", add_body_model,
            body_model_options},
#if defined(ATELIER_HAS_REGISTRATION) && defined(ATELIER_HAS_SIMULATION)
    Command{"drape", "sew a garment from its pattern on the default body", add_drape,
            drape_options},
#endif
#endif
#endif
#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_BODYMODEL) && \
    defined(ATELIER_HAS_REGISTRATION) && defined(ATELIER_HAS_SIMULATION)
    Command{"synthesize", "a capture of a clothed person, with the truth behind it", add_synthesize,
            synthesize_options},
#endif
#ifdef ATELIER_HAS_CAPTURE
    Command{"convert-capture", "a capture into another layout: any of those that are read",
            add_convert_capture, convert_capture_options},
#ifdef ATELIER_HAS_CAPTURE_CALIBRATION
    Command{"calibrate", "cameras from pictures of a board: lenses, poses, how sure they are",
            add_calibrate, calibrate_options},
#endif
#ifdef ATELIER_HAS_CAPTURE_SURFACE
    Command{"calibrate-color", "gain and white balance between the cameras of a capture",
            add_calibrate_color, calibrate_color_options},
#endif
#ifdef ATELIER_HAS_CAPTURE_MASKS
    Command{"masks", "who is in the pictures: from plates, a coloured screen, or over time",
            add_masks, masks_options},
#endif
#ifdef ATELIER_HAS_CAPTURE_SURFACE
    Command{"depth", "depth maps of a frame, of some views or all, also for COLMAP", add_depth,
            depth_options},
#endif
#ifdef ATELIER_HAS_CAPTURE_DETECTION
    Command{"detect", "keypoints or labels of pictures by a network of your own (ONNX)", add_detect,
            detect_options},
#endif
#if defined(ATELIER_HAS_APPEARANCE) && defined(ATELIER_HAS_CORE_RENDER)
    Command{"draw", "a dressed person in motion, by the networks of the stage appearance", add_draw,
            draw_options},
#endif
    Command{"evaluate", "results against the truth of a synthetic capture", add_evaluate},
#endif
    Command{"export", "results of a workspace as files that other programs open", add_export,
            export_options},
    Command{"report", "one HTML page on a workspace: warnings, figures, pictures", add_report,
            report_options},
    Command{"options", "every option of every stage and command", add_options},
    Command{"completion", "a completion script for bash", add_completion},
};

}  // namespace

std::span<const Command> all_commands() {
  return kCommands;
}

}  // namespace atelier
