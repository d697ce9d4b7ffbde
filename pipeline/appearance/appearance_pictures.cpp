#include "pipeline/appearance/appearance_pictures.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <vector>

#include "capture/frame_reader.h"
#include "core/io/child_program.h"
#include "core/io/file_bytes.h"
#include "core/limits.h"
#include "core/split_text.h"
#include "pipeline/outfit/worn_subject.h"
#include "pipeline/pictures/report_drawings.h"
#include "pipeline/pictures/report_page.h"
#include "pipeline/pictures/report_plots.h"
#include "pipeline/pictures/taken_and_drawn.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// Cameras and frames that nothing was learnt from, as they were taken and as networks draw them.
std::string held_out_pictures(const StageStatus& own, const ReportPlaces& places) {
  if (own.state != StageStatus::State::Done || !has_child_program("atelier-appearance")) {
    return "";
  }
  const Dataset dataset = dataset_of(own);
  std::map<std::string, fs::path> inputs;
  for (const ManifestInput& input : own.manifest->inputs) {
    inputs[input.kind] = places.workspace / input.stage / fs::path(input.path).filename();
  }
  const WornSubject worn = worn_in_workspace(inputs.at("registered"), inputs.at("bodies"));
  std::map<std::size_t, std::string> models;
  for (std::size_t s = 0; s < worn.templates.size(); ++s) {
    const fs::path model =
        result_folder_of(own, places) / worn.subject.names[s] / "model.safetensors";
    if (fs::exists(model)) {
      models[s] = model.string();
    }
  }
  constexpr std::size_t kShown = 3;
  const std::vector<int> frame_ids = spread(dataset.info.held_out_frames, kShown);
  const std::vector<std::string>& held = dataset.info.held_out_cameras;
  FrameReader reader(dataset);
  std::vector<TakenView> views;
  for (std::size_t i = 0; i < frame_ids.size() && !held.empty(); ++i) {
    const auto camera =
        std::find_if(dataset.cameras.begin(), dataset.cameras.end(),
                     [&](const Camera& one) { return one.id == held[i % held.size()]; });
    if (camera == dataset.cameras.end()) {
      continue;
    }
    const auto picture = reader.image(camera - dataset.cameras.begin(), frame_ids[i]);
    if (picture && picture->width == camera->width && picture->height == camera->height) {
      views.push_back({*camera, frame_ids[i], coloured(*picture)});
    }
  }
  if (views.empty()) {
    return "";
  }
  return figure_html(
      *taken_and_drawn(worn, models, views, Device::Cpu),
      "Held-out cameras in held-out frames, which were not used for training: images as "
      "taken and as rendered by the networks");
}

/// How each network came to what it is, from its training.csv: at most so many steps of it.
std::string training_plots(const StageStatus& own, const fs::path& result) {
  constexpr std::size_t kSteps = 120;
  std::string html;
  for (const ManifestOutput& output : own.manifest->outputs) {
    if (!output.path.ends_with("training.csv")) {
      continue;
    }
    FramePlot all{"PSNR of the training's pixels, dB", {}, {}};
    const std::vector<std::string> lines =
        split_text(read_file_text(result / output.path, Limits{}.text_file_bytes), '\n');
    for (std::size_t i = 1; i < lines.size(); ++i) {  // behind the names of the columns
      const std::string& line = lines[i];
      int step = 0;
      double loss = 0;
      double psnr = 0;
      if (std::sscanf(line.c_str(), "%d,%lf,%lf", &step, &loss, &psnr) == 3) {
        all.frame_ids.push_back(step);
        all.values.push_back(psnr);
      }
    }
    const std::string svg = plots_svg({thinned(all, kSteps)});
    html += svg.empty() ? ""
                        : "<figure>" + svg + "<figcaption>" + html_text(output.path) +
                              ", over steps</figcaption></figure>\n";
  }
  return html;
}

}  // namespace

std::string appearance_pictures(const StageStatus& own, const ReportPlaces& places) {
  return held_out_pictures(own, places) + training_plots(own, result_folder_of(own, places));
}

}  // namespace atelier
