#include "pipeline/chain/run_chain.h"

#include <algorithm>
#include <array>

#include "core/io/child_program.h"
#include "core/parallel.h"
#include "core/store/stage.h"
#include "pipeline/chain/run_scene.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;
using Names = std::vector<std::string_view>;

constexpr const char* kNoMasks =
    "no frame has images with masks or labels of two cameras; atelier masks creates masks";

std::string nothing(const CaptureFacts& /*facts*/) {
  return "";
}

std::string no_cameras(const CaptureFacts& facts) {
  return !facts.calibrated   ? "the cameras are not calibrated; atelier calibrate calibrates them"
         : facts.cameras < 2 ? "there are fewer than two cameras that stages may open"
                             : "";
}

std::string no_evidence(const CaptureFacts& facts) {
  const std::string cameras = no_cameras(facts);
  return !cameras.empty() ? cameras
         : facts.masked_frames == 0 && !facts.detections
             ? "neither masks of two cameras nor 2D keypoints; atelier masks and atelier detect "
               "create them"
             : "";
}

std::string no_keypoints(const CaptureFacts& facts) {
  const std::string evidence = no_evidence(facts);
  return !evidence.empty()   ? evidence
         : !facts.detections ? "no 2D keypoints; atelier detect creates them"
                             : "";
}

std::string no_masks(const CaptureFacts& facts) {
  return facts.masked_frames == 0 ? kNoMasks : "";
}

std::string no_clothes(const CaptureFacts& facts) {
  return facts.masked_frames == 0    ? kNoMasks
         : facts.clothed_frames == 0 ? "no clothed sequence has masks"
                                     : "";
}

std::string no_look(const CaptureFacts& facts) {
  return !has_child_program("atelier-appearance")
             ? "the program atelier-appearance is not there; it requires a build with libtorch"
             : no_clothes(facts);
}

Names template_alone(const CaptureFacts& /*facts*/) {
  return {"template"};
}

fs::path flat_meshes(const RunPlaces& places, const CaptureFacts& /*facts*/) {
  return flat_surfaces(places.workspace);
}

Names of_clothes(const CaptureFacts& /*facts*/) {
  return {"body", "register"};
}

fs::path scene_of(const RunPlaces& places, const CaptureFacts& /*facts*/) {
  return captured_scene(places.workspace);
}

std::string no_scene(const CaptureFacts& facts) {
  return facts.clothed_frames > 0 ? "" : "no garment was captured; animate puts a drafted one on";
}

/// Where no garment was captured, drafted ones are worn.
Names of_worn(const CaptureFacts& facts) {
  return facts.clothed_frames > 0 ? Names{"body", "template", "register"} : Names{};
}

// Seconds on two cores, from demo captures of seeds 5 and 11.
constexpr std::array kSteps = {
    RunStep{"validate", nothing, nullptr, nullptr, {.seconds = 2, .per_picture = 0.04}},
    RunStep{"reconstruct", no_evidence, nullptr, nullptr, {.per_picture = 7, .parallel = true}},
    RunStep{"personalize", no_keypoints, nullptr, nullptr, {.seconds = 8}},
    RunStep{"track", no_keypoints, nullptr, nullptr, {.seconds = 1, .per_frame = 0.25}},
    RunStep{"body", no_masks, nullptr, nullptr, {.per_frame = 2.6, .parallel = true}},
    RunStep{"template", no_clothes, nullptr, nullptr, {.seconds = 60, .per_clothed = 2}},
    RunStep{"register", no_clothes, nullptr, nullptr, {.seconds = 10, .per_clothed = 3}},
    RunStep{"flatten", no_clothes, template_alone, flat_meshes, {.seconds = 30}},
    RunStep{"material", no_clothes, nullptr, nullptr, {.seconds = 30}},
    RunStep{"simulate", no_scene, of_clothes, scene_of, {.seconds = 30, .per_frame = 0.8}},
    RunStep{"appearance", no_look, nullptr, nullptr, {.seconds = 100, .per_clothed = 1}},
    RunStep{"animate", no_evidence, of_worn, nullptr, {.seconds = 20, .per_frame = 1}},
};

constexpr StageCost kReport{.seconds = 8, .per_picture = 0.1};
/// Figures against the ground truth measure every surface once more.
constexpr StageCost kGroundTruthReport{.seconds = 10, .per_picture = 0.1, .per_clothed = 3};

double expected_seconds(const StageCost& cost, int looked_at, const CaptureFacts& facts) {
  constexpr double kMeasuredCores = 2;
  const double seconds = cost.seconds +
                         cost.per_picture * facts.megapixels * facts.cameras * looked_at +
                         cost.per_frame * facts.frames + cost.per_clothed * facts.clothed_frames;
  return cost.parallel ? seconds * kMeasuredCores / std::max(1, thread_count()) : seconds;
}

/// The stages that make these kinds.
Names makers_of(std::span<const std::string_view> kinds) {
  Names makers;
  for (const std::string_view kind : kinds) {
    const Stage* maker = kind.empty() ? nullptr : stage_that_makes(all_stages(), kind);
    if (maker != nullptr) {
      makers.push_back(maker->name);
    }
  }
  return makers;
}

}  // namespace

std::span<const RunStep> run_steps() {
  return kSteps;
}

std::vector<std::string_view> needed_stages(const RunStep& step, const CaptureFacts& facts) {
  const Stage* row = find_stage(all_stages(), step.stage);
  std::vector<std::string_view> needed = row == nullptr ? Names{} : makers_of(row->inputs);
  if (step.made_of != nullptr) {
    const std::vector<std::string_view> more = step.made_of(facts);
    needed.insert(needed.end(), more.begin(), more.end());
  }
  return needed;
}

std::vector<std::string_view> optional_stages(const RunStep& step) {
  const Stage* row = find_stage(all_stages(), step.stage);
  return row == nullptr ? Names{} : makers_of(row->optional_inputs);
}

double expected_seconds(const RunStep& step, const CaptureFacts& facts) {
  const int looked_at = step.stage == "validate" ? facts.pictured_frames : facts.masked_frames;
  return expected_seconds(step.cost, looked_at, facts);
}

double expected_report_seconds(const CaptureFacts& facts) {
  return expected_seconds(facts.synthetic ? kGroundTruthReport : kReport, facts.masked_frames,
                          facts);
}

}  // namespace atelier
