#include <algorithm>
#include <iostream>
#include <memory>
#include <numbers>
#include <optional>
#include <set>

#include "apps/commands/opened_workspace.h"
#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/failure.h"
#include "apps/console/interrupt.h"
#include "apps/console/option_flags.h"
#include "capture/layouts/open_dataset.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/io/image_file.h"
#include "core/io/lower_extension.h"
#include "core/plain_name.h"
#include "core/printable.h"
#include "core/render/video.h"
#include "core/store/output_place.h"
#include "core/store/result.h"
#include "core/store/unfinished_folder.h"
#include "core/usage_error.h"
#include "core/writable_place.h"
#include "pipeline/avatar/drawn_scene.h"
#include "pipeline/chain/outdated_results.h"
#include "pipeline/pictures/normal_pictures.h"
#include "pipeline/pictures/paint_scene.h"
#include "pipeline/pictures/picture_size.h"
#include "pipeline/pictures/straight_alpha.h"
#include "pipeline/sealing/consent_check.h"
#include "pipeline/sealing/sealed_subject.h"
#include "pipeline/sealing/signed_render.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

struct DrawArguments : DrawnSources {
  std::string out;
  std::string camera;
  std::string signing_key;
  KeyArguments keys;
};

struct DrawOptions {
  std::string networks = "appearance";  ///< whose: "appearance", "oracle"
  double azimuth = 34;                  ///< degrees; as kThreeQuarter
  double elevation = 9;                 ///< degrees
  bool turn = false;                    ///< once round the subject over all frames
  bool normals = false;                 ///< normals of the surfaces instead of networks
  std::vector<double> frames;           ///< numbers of those that are drawn; none: all
  bool avatar = true;                   ///< the body as `avatar` has made it, where it has
  bool mark = true;                     ///< images say what they are
  ImageFormat format = ImageFormat::Png;
  PictureOptions picture;
  VideoOptions video;
  PaintOptions paint;
  Device device = Device::Cpu;
  ConsentUse use;
};

OptionTable describe(DrawOptions& options) {
  OptionTable table;
  table.add("networks", options.networks, {"appearance", "oracle"},
            "Stage whose networks are used; oracle: those trained and rendered on the ground-truth "
            "garments and body of --capture");
  table.add("azimuth", options.azimuth, -360, 360, "degrees",
            "Azimuth of the camera: 0 in front of the subject, 90 at its left");
  table.add("elevation", options.elevation, -90, 90, "degrees",
            "Elevation of the camera: 0 level, 90 above");
  table.add("turn", options.turn, "Camera that goes once round the subject over all frames");
  table.add("normals", options.normals,
            "Normals of the surfaces as colours, instead of what networks make of them: red to the "
            "right, green upwards, blue towards the camera");
  table.add("frames", options.frames, 0, 1e9, "",
            "Numbers of the frames that are drawn; empty: all");
  table.add("avatar", options.avatar,
            "Body with skin, hair and shoes, where the workspace has an avatar; off: the body that "
            "clothes lie on");
  table.add("mark", options.mark,
            "Invisible mark and content credentials of what is drawn, which verify reads; off: "
            "exactly what the networks drew, for figures of a paper");
  table.add("format", options.format, {{"png", ImageFormat::Png}, {"jpeg", ImageFormat::Jpeg}},
            "Format of images: png without loss, jpeg a part of its size and without alpha");
  table.add("width", options.picture.width, 1, 16384, "px",
            "Width of images that are not from a camera of the capture");
  table.add("height", options.picture.height, 1, 16384, "px",
            "Height of images that are not from a camera of the capture");
  table.add("framing", describe(options.picture.framing));
  table.add("video", describe(options.video));
  for (OptionField& field : table.fields) {
    if (field.name == "video.fps") {
      field.help = "Frame rate of the video; unless given, that of the meshes if they have one";
    }
  }
  table.add(describe(options.paint));
  table.add("device", options.device, {{"cpu", Device::Cpu}, {"cuda", Device::Cuda}},
            "Device of the networks");
  table.add(describe(options.use));
  return table;
}

/// Whether somebody named this very file or folder as meshes, whatever it holds.
bool is_named(const DrawArguments& arguments, const fs::path& file) {
  const auto is_value = [&](const std::string& value) {
    return file == value.substr(value.find('=') + 1);
  };
  return file == arguments.body ||
         std::any_of(arguments.garments.begin(), arguments.garments.end(), is_value);
}

/// What is drawn, with its frames. What is wrong with a file of a result is said with the stage
/// that recomputes it.
DrawnScene whole_scene(const DrawArguments& arguments, const DrawOptions& options) {
  if (!fs::is_directory(arguments.workspace)) {
    throw DataError(arguments.workspace, "", "no folder", "a workspace");
  }
  try {
    DrawnScene drawn =
        options.networks == "oracle" ? ground_truth_scene(arguments) : drawn_scene(arguments);
    const auto warn = [](const std::string& sentence) {
      std::cout << "warning: " << sentence << std::endl;
    };
    require_body(drawn, arguments, warn);
    if (options.avatar && options.networks != "oracle") {
      use_avatar(drawn, arguments.workspace);
    }
    require_light(drawn, options.paint.occlusion);
    fill_frames(drawn, options.frames, warn);
    return drawn;
  } catch (const DataError& error) {
    for (const Stage& stage : all_stages()) {
      // Of a sound result that is no sequence, recomputing it would change nothing.
      const std::string advice =
          is_named(arguments, error.file)
              ? "one in every frame, as the results of 'body' and 'register' (registered/NAME) have"
              : "run 'atelier " + std::string(stage.name) + "' again";
      if (!error.file.empty() &&
          is_inside(error.file, fs::path(arguments.workspace) / stage.name) &&
          error.expected.find("run 'atelier") == std::string::npos) {
        throw DataError(error.file, error.where, error.found, error.expected + "; " + advice);
      }
    }
    throw;
  }
}

/// The camera of the capture that looks; nothing where it goes round the subject, whose images
/// then have a size. Before any mesh is read: what is refused here has nothing to do with them.
std::optional<Camera> captured_camera(const DrawArguments& arguments, const DrawOptions& options) {
  if (arguments.capture.empty()) {
    require_picture_size(options.picture);
    return std::nullopt;
  }
  std::string ids;
  for (const Camera& camera : open_dataset(arguments.capture).cameras) {
    if (camera.id == arguments.camera) {
      return camera;
    }
    ids += (ids.empty() ? "" : ", ") + camera.id;
  }
  throw UsageError("the capture has no camera '" + arguments.camera.substr(0, 80) + "'; it has " +
                   ids);
}

/// Round the subject.
View view_of(const DrawOptions& options) {
  return {options.azimuth * std::numbers::pi / 180, options.elevation * std::numbers::pi / 180};
}

/// How a video is played: as fast as its meshes say, unless it was said otherwise.
VideoOptions video_options(const OptionSet& set, double rate) {
  VideoOptions video = options_of<DrawOptions>(set).video;
  for (const OptionField& field : set.table.fields) {
    if (field.name == "video.fps" && field.source == "default" && rate > 0) {
      video.fps = std::clamp(rate, field.min, field.max);
    }
  }
  return video;
}

/// Options that the kind of output leaves without effect.
void require_use(const DrawOptions& options, const OptionTable& table, bool video) {
  for (const OptionField& field : table.fields) {
    if (field.source == "default") {
      continue;
    }
    if (field.name.starts_with("video.") && !video) {
      throw UsageError(flag_of(field.name) + " is of a video; name --out T.mp4, or leave it out");
    }
    if (field.name == "format" && (video || options.paint.alpha)) {
      throw UsageError(video ? "--format is of images, not of a video; leave it out"
                             : "--format goes without --alpha, whose images are png");
    }
    if (options.normals && (field.name == "device" || field.name.starts_with("occlusion."))) {
      throw UsageError(flag_of(field.name) +
                       " is of networks and does nothing with --normals; leave one of them out");
    }
    if (field.name == "background" && options.paint.alpha) {
      throw UsageError("--background does nothing with --alpha; leave one of them out");
    }
  }
}

/// Refuses options that place the camera round the subject beside a capture's camera: they would do
/// nothing.
void require_use(const DrawArguments& arguments, const OptionTable& table) {
  static const std::set<std::string> placing = {"azimuth", "elevation", "turn", "width", "height"};
  for (const OptionField& field : table.fields) {
    if (!arguments.capture.empty() && field.source != "default" &&
        (placing.contains(field.name) || field.name.starts_with("framing."))) {
      throw UsageError(flag_of(field.name) +
                       " does nothing: the camera of --capture is used; leave one of them out");
    }
  }
}

/// What images of the workspace say of themselves. Refuses one of people who have not consented to
/// the use: throws ConsentRefused.
RenderStatement statement_of(const fs::path& workspace, const DrawOptions& options) {
  RenderStatement statement;
  statement.purpose = options.use.purpose;
  statement.drawn = options.normals ? kDrawnNormals : kDrawnByNetworks;
  statement.tool = drawing_tool();
  for (const StageStatus& status : workspace_status(all_stages(), workspace)) {
    add_consent(statement.consent, consent_of(status));
    if (status.manifest) {
      statement.made_of.emplace_back(status.stage, hex(outputs_digest(*status.manifest)));
    }
  }
  for (const std::string& doubt : require_consent(statement.consent, options.use)) {
    std::cout << "warning: " << printable(doubt) << std::endl;
  }
  return statement;
}

int run(DrawArguments arguments, const OptionSet& set) {
  const auto& options = options_of<DrawOptions>(set);
  if (arguments.workspace.empty() || arguments.out.empty()) {
    throw UsageError(
        "render --neural takes a WORKSPACE and --out: atelier render --neural WORKSPACE --out "
        "FOLDER");
  }
  if (arguments.camera.empty() != arguments.capture.empty()) {
    throw UsageError("--capture and --camera go together: the camera ID of the capture CAPTURE");
  }
  if (options.networks == "oracle") {
    if (arguments.capture.empty()) {
      throw UsageError(
          "--networks oracle renders the ground truth of a synthetic capture: give --capture and "
          "--camera");
    }
    if (!arguments.body.empty() || !arguments.garments.empty()) {
      throw UsageError(
          "--body and --garment do nothing: --networks oracle renders the ground truth of "
          "--capture; leave them out");
    }
  }
  require_use(arguments, set.table);
  if (options.paint.background.size() != 3) {
    throw UsageError("--background takes three numbers, as in [0.9, 0.9, 0.9]");
  }
  const std::string extension = lower_extension(arguments.out);
  const bool video = extension == ".mp4";
  static const std::set<std::string> other_kinds = {".avi", ".gif", ".jpg", ".m4v",
                                                    ".mkv", ".mov", ".png", ".webm"};
  if (other_kinds.contains(extension)) {
    throw UsageError("--out takes a folder or a video .mp4, not '" + extension + "'");
  }
  if (video && options.paint.alpha) {
    throw UsageError("a video has no alpha channel: leave out --alpha, or choose a folder");
  }
  require_use(options, set.table, video);
  if (!options.mark && !arguments.signing_key.empty()) {
    throw UsageError("--sign does nothing with --mark false; leave one of them out");
  }
  const OpenedWorkspace opened(arguments.workspace, arguments.keys);
  arguments.workspace = opened.path();
  catch_interrupts();
  require_new_place(arguments.out, "--out");
  require_outside_results(arguments.out, arguments.workspace, all_stages(), "--out");
  if (is_inside(arguments.out, arguments.workspace)) {
    throw UsageError("--out lies in the WORKSPACE; choose a path outside of it");
  }
  video ? require_file_place(arguments.out) : require_folder_place(arguments.out);
  const std::optional<Camera> captured = captured_camera(arguments, options);
  DrawnScene subject = whole_scene(arguments, options);
  RenderStatement statement = statement_of(arguments.workspace, options);
  for (const std::string& one : outdated_results(arguments.workspace, {options.networks})) {
    std::cout << "warning: " << printable(as_called(one)) << std::endl;
  }
  const VideoOptions video_as = video_options(set, scene_frame_rate(subject));
  subject.scene.cameras =
      captured ? std::vector{*captured}
               : subject_cameras(subject, view_of(options), options.turn, options.picture);
  const std::string mark =
      options.mark ? "mark " + mark_text(mark_of(statement)) : "without a mark";
  std::optional<SignedRender> render;
  if (options.mark) {
    render.emplace(signed_render(std::move(statement), arguments.signing_key,
                                 [] { return passphrase_of("", false); }));
  }
  std::optional<UnfinishedFolder> folder;  // a killed run leaves nothing at the place of --out
  std::optional<VideoWriter> writer;
  if (video) {
    writer.emplace(arguments.out, video_as);
  } else {
    folder.emplace(arguments.out);
    make_private_directory(folder->content());
  }
  PaintHooks hooks;
  hooks.stop = [] { return interrupted(); };
  hooks.picture = [&](Index i, const Image& picture) {
    const std::string name = frame_name(subject.scene.frame_ids[static_cast<std::size_t>(i)]);
    const bool jpeg = options.format == ImageFormat::Jpeg;
    const Image image = video || jpeg ? before_black(picture) : straight_alpha(picture);
    if (video) {
      render ? writer->add(render->marked(image)) : writer->add(image);
    } else {
      const fs::path file = folder->content() / (name + (jpeg ? ".jpg" : ".png"));
      render ? render->write(file, image) : write_image(file, image);
    }
    std::cout << "frame " << name << std::endl;
  };
  const bool drawn = options.normals
                         ? draw_normals(subject.scene, options.paint, hooks)
                         : paint_scene(subject.scene, options.paint, options.device, hooks);
  if (!drawn) {
    writer.reset();  // end_by_signal leaves no scope
    folder.reset();
    end_by_signal();
  }
  opened.log("render --neural", arguments.out + ", for " + options.use.purpose + ", " + mark);
  if (writer) {
    render ? writer->finish([&](const fs::path& file) { return render->video_credentials(file); })
           : writer->finish();
  } else {
    folder->finish();
  }
  return kExitDone;
}

}  // namespace

OptionSet draw_options() {
  return option_set<DrawOptions>();
}

Action add_draw(CLI::App& parser) {
  auto arguments = std::make_shared<DrawArguments>();
  add_option(parser, "WORKSPACE", arguments->workspace,
             "Workspace with the networks, or a sealed one")
      .required();
  add_option(parser, "--out", arguments->out,
             "New folder for images (000012.png ...), or a new video (.mp4)")
      .type_name("FOLDER|VIDEO")
      .required();
  add_option(parser, "--body", arguments->body,
             "Meshes of the body, one for each frame [those of the stage body]")
      .type_name("MESHES");
  add_option(parser, "--garment", arguments->garments,
             "Meshes of a garment with the faces of its template [those of the stage register]")
      .type_name("NAME=MESHES")
      .once_a_flag();
  add_option(parser, "--capture", arguments->capture,
             "Capture whose camera is used [a camera around the subject]")
      .type_name("CAPTURE");
  add_option(parser, "--camera", arguments->camera, "Camera of --capture").type_name("ID");
  add_option(parser, "--sign", arguments->signing_key,
             "Secret key by which images are signed, as atelier key --signing writes it [one that "
             "everybody can derive, which says that they are whole, not whose]")
      .type_name("FILE");
  add_key_arguments(parser, arguments->keys);
  const OptionReader options = add_option_flags(parser, draw_options());
  return [arguments, options] { return run(*arguments, options()); };
}

}  // namespace atelier
