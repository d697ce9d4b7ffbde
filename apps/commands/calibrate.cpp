#include <iostream>
#include <memory>

#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/option_flags.h"
#include "apps/console/tell_consent.h"
#include "capture/calibration/calibration_report.h"
#include "capture/input/board_pictures.h"
#include "capture/input/keypoint_rig.h"
#include "capture/layouts/open_dataset.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/io/cameras_file.h"
#include "core/io/file_bytes.h"
#include "core/printable.h"
#include "core/store/output_place.h"
#include "core/usage_error.h"
#include "core/writable_place.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

struct CalibrateArguments {
  std::string pictures;
  std::string out;
  std::string lenses;
  bool by_keypoints = false;
  bool json = false;
};

struct CalibrateCommandOptions {
  BoardOptions board;
  CalibrateOptions calibration;
  KeypointRigOptions person;
  LensFit lens_fit = LensFit::Exact;
  int every = 1;
  int ground_frame = -1;
};

OptionTable describe(CalibrateCommandOptions& options) {
  OptionTable table;
  table.add("board", describe(options.board));
  table.add("calibration", describe(options.calibration));
  table.add("person", describe(options.person));
  table.add(
      "lens_fit", options.lens_fit,
      {{"exact", LensFit::Exact},
       {"cropped", LensFit::Cropped},
       {"padded", LensFit::Padded},
       {"stretched", LensFit::Stretched}},
      "Relation of images to a size of another aspect ratio in --lenses: cropped evenly, padded "
      "with bars on both sides, or stretched; exact: they are refused");
  table.add("every", options.every, 1, 100000, "",
            "Interval between the frames of videos that are searched for the board; 1: all frames");
  table.add("ground_frame", options.ground_frame, -1, 1000000000, "",
            "Frame in which the board lies on the ground, its centre at the origin; -1: up is the "
            "mean of the cameras' up axes, the origin where they look");
  return table;
}

/// Cameras whose pose is known.
std::vector<Camera> cameras_of(const Calibration& calibration) {
  std::vector<Camera> cameras;
  for (std::size_t c = 0; c < calibration.cameras.size(); ++c) {
    if (calibration.quality[c].in_rig) {
      cameras.push_back(calibration.cameras[c]);
    }
  }
  return cameras;
}

/// A capture, a calibration file of any layout, or cameras.json or lenses.json alone, as
/// `calibrate` writes them.
Dataset lenses_of(const fs::path& path) {
  if (path.filename() != "cameras.json" && path.filename() != "lenses.json") {
    return open_dataset(path);
  }
  Dataset dataset;
  dataset.root = path;
  dataset.cameras =
      parse_cameras_json(read_file_text(path, Limits{}.text_file_bytes), path.string());
  return dataset;
}

/// By images of a board.
Calibration by_boards(const CalibrateArguments& arguments, const CalibrateCommandOptions& options) {
  BoardPictures pictures =
      find_boards(open_board_pictures(arguments.pictures), options.board, options.every);
  for (const Finding& finding : pictures.findings) {
    if (finding.code == "board-nearby" && pictures.views.empty()) {
      throw DataError(arguments.pictures, finding.place, finding.what,
                      finding.advice + ": " + finding.setting);
    }
  }
  if (!arguments.lenses.empty()) {
    pictures.rig =
        with_lenses(std::move(pictures.rig), lenses_of(arguments.lenses), options.lens_fit);
  }
  Calibration calibration =
      calibrate(pictures.rig, pictures.views, options.board, options.calibration);
  calibration.rejected.insert(calibration.rejected.begin(), pictures.rejected.begin(),
                              pictures.rejected.end());
  calibration.findings.insert(calibration.findings.begin(), pictures.findings.begin(),
                              pictures.findings.end());
  return calibration.lenses_alone
             ? calibration
             : stand_up(std::move(calibration), options.board, options.ground_frame);
}

/// By the keypoints of a person in a capture.
Calibration by_keypoints(const CalibrateArguments& arguments,
                         const CalibrateCommandOptions& options) {
  if (arguments.lenses.empty() || options.person.stature <= 0) {
    throw UsageError(
        "--by-keypoints takes the lenses and a length as well: --lenses FILE, as calibrate "
        "--calibration.poses=false finds them from images of a board, and --person.stature");
  }
  const Dataset capture = open_dataset(arguments.pictures);
  tell_ended_consent(capture);
  std::vector<RigCamera> rig;
  for (std::size_t c = 0; c < capture.cameras.size(); ++c) {
    RigCamera camera;
    camera.camera.id = capture.cameras[c].id;
    camera.camera.width = capture.frames[c].image_width;
    camera.camera.height = capture.frames[c].image_height;
    rig.push_back(camera);
  }
  return calibrate_by_keypoints(
      with_lenses(std::move(rig), lenses_of(arguments.lenses), options.lens_fit), capture,
      options.person);
}

int run(const CalibrateArguments& arguments, const CalibrateCommandOptions& options) {
  if (arguments.pictures.empty() || arguments.out.empty()) {
    throw UsageError(
        "calibrate takes IMAGES of a board and --out: atelier calibrate IMAGES --out FOLDER");
  }
  const fs::path out = arguments.out;
  require_outside_input(out, arguments.pictures, "--out", "IMAGES");
  require_new_place(out, "--out");
  require_folder_place(out);
  const Calibration calibration =
      arguments.by_keypoints ? by_keypoints(arguments, options) : by_boards(arguments, options);
  const std::string json = calibration_json(calibration);
  make_private_directory(out);
  write_file_atomically(out / "calibration.json", json + "\n");
  // Lenses without poses are no rig: no program takes them for one by their name.
  const fs::path cameras = out / (calibration.lenses_alone ? "lenses.json" : "cameras.json");
  write_file_atomically(cameras, cameras_json(cameras_of(calibration)));
  if (arguments.json) {
    std::cout << json << "\n";
  } else {
    std::cout << calibration_text(calibration) << cameras.string() << "\n";
  }
  if (has_errors(calibration.findings)) {
    return kExitBadData;
  }
  return calibration.converged ? kExitDone : kExitNotConverged;
}

}  // namespace

OptionSet calibrate_options() {
  return option_set<CalibrateCommandOptions>();
}

Action add_calibrate(CLI::App& parser) {
  auto arguments = std::make_shared<CalibrateArguments>();
  add_option(parser, "IMAGES", arguments->pictures,
             "Images of the board: a folder, zip or video for each camera, or a folder of images "
             "such as left01.jpg; with --by-keypoints a capture with 2D keypoints")
      .required();
  add_option(parser, "--out", arguments->out,
             "New folder for cameras.json and calibration.json; of lenses alone, lenses.json")
      .type_name("FOLDER");
  add_option(parser, "--lenses", arguments->lenses,
             "Capture or calibration file whose lenses are kept, so that only poses are estimated")
      .type_name("CAPTURE");
  add_flag(parser, "--by-keypoints", arguments->by_keypoints,
           "Poses from the 2D keypoints of a person instead of a board; needs --lenses and "
           "--person.stature");
  add_flag(parser, "--json", arguments->json, "Report as JSON, for programs");
  const OptionReader options = add_option_flags(parser, calibrate_options());
  return [arguments, options] {
    return run(*arguments, options_of<CalibrateCommandOptions>(options()));
  };
}

}  // namespace atelier
