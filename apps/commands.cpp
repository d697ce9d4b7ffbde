#include <array>

#include "apps/command.h"

namespace atelier {
namespace {

constexpr std::array kCommands = {
#ifdef ATELIER_HAS_CAPTURE
    Command{"run", "every stage of a capture, from its images to the report", add_run},
#endif
    Command{"status", "results in a workspace and their state", add_status},
    Command{"inspect", "contents of a file: sizes, ranges, units, findings", add_inspect},
    Command{"gc", "removal of unfinished work and of results that are no longer current", add_gc},
    Command{"convert", "conversion of a mesh to another format", add_convert, convert_options},
#ifdef ATELIER_HAS_CORE_RENDER
    Command{"render", "an image of a mesh", add_render, render_options},
#ifdef ATELIER_HAS_BODYMODEL
    Command{"body-model", "images, measurements, conversion and posing of a body", add_body_model,
            body_model_options},
#if defined(ATELIER_HAS_REGISTRATION) && defined(ATELIER_HAS_SIMULATION)
    Command{"drape", "a garment sewn from its pattern and draped on the default body", add_drape,
            drape_options},
#endif
#endif
#endif
#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_BODYMODEL) && \
    defined(ATELIER_HAS_REGISTRATION) && defined(ATELIER_HAS_SIMULATION)
    Command{"synthesize", "a synthetic capture of a clothed person, with its ground truth",
            add_synthesize, synthesize_options},
#endif
#ifdef ATELIER_HAS_CAPTURE
    Command{"convert-capture", "conversion of a capture to another layout", add_convert_capture,
            convert_capture_options},
#ifdef ATELIER_HAS_CAPTURE_CALIBRATION
    Command{"calibrate",
            "camera calibration from images of a board: lenses, poses and their accuracy",
            add_calibrate, calibrate_options},
#endif
#ifdef ATELIER_HAS_CAPTURE_SURFACE
    Command{"calibrate-color", "gain and white balance between the cameras of a capture",
            add_calibrate_color, calibrate_color_options},
#endif
#ifdef ATELIER_HAS_CAPTURE_MASKS
    Command{"masks", "segmentation of the person: by clean plates, a coloured screen, or over time",
            add_masks, masks_options},
#endif
#ifdef ATELIER_HAS_CAPTURE_SURFACE
    Command{"depth", "depth maps of one frame, of some or all views, also for COLMAP", add_depth,
            depth_options},
#endif
#ifdef ATELIER_HAS_CAPTURE_DETECTION
    Command{"detect", "keypoints or labels of images by a network of your own (ONNX)", add_detect,
            detect_options},
#endif
#if defined(ATELIER_HAS_APPEARANCE) && defined(ATELIER_HAS_CORE_RENDER)
    Command{"render-neural",
            "render --neural: images of a clothed person by the networks of the stage appearance",
            add_draw, draw_options},
#endif
    Command{"evaluate", "evaluation of results against the ground truth of a synthetic capture",
            add_evaluate},
#endif
    Command{"export", "export of a workspace's results to files for other programs", add_export,
            export_options},
    Command{"report", "one HTML page on a workspace: warnings, figures, images", add_report,
            report_options},
    Command{"options", "list of all options of all stages and commands", add_options},
    Command{"completion", "completion script for bash", add_completion},
};

}  // namespace

std::span<const Command> all_commands() {
  return kCommands;
}

}  // namespace atelier
