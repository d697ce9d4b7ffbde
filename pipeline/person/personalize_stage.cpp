#include "pipeline/person/personalize_stage.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "bodymodel/formats/body_file.h"
#include "core/error.h"
#include "core/normals.h"
#include "core/unknown_value.h"

namespace atelier {
namespace {

/// The sequence that a person is measured on: the one named, the first minimal one, else the first.
const CaptureSequence& measured_sequence(const CaptureInfo& info, const std::string& name) {
  if (!name.empty()) {
    std::string names;
    for (const CaptureSequence& sequence : info.sequences) {
      if (sequence.name == name) {
        return sequence;
      }
      names += (names.empty() ? "" : ", ") + sequence.name;
    }
    throw UnknownValue("", "sequence", name, "one of " + names);
  }
  for (const CaptureSequence& sequence : info.sequences) {
    if (sequence.kind == "minimal") {
      return sequence;
    }
  }
  return info.sequences.front();
}

CaptureSequence thinned(CaptureSequence sequence, int most) {
  const std::size_t count = sequence.frame_ids.size();
  const auto wanted = static_cast<std::size_t>(most);
  if (count > wanted) {
    std::vector<int> kept;
    for (std::size_t i = 0; i < wanted; ++i) {
      kept.push_back(sequence.frame_ids[i * count / wanted]);
    }
    sequence.frame_ids = kept;
  }
  return sequence;
}

}  // namespace

OptionTable describe(PersonalizeStageOptions& options) {
  OptionTable table;
  table.add("input", describe(options.input));
  table.add("body", options.body, std::vector<std::string>{},
            "Initial body model: a file, or default, female, male");
  table.add(describe(options.fit));
  table.add("sequence", options.sequence, std::vector<std::string>{},
            "Name of the sequence to measure on; empty: the first minimally clothed one");
  table.add("max_frames", options.max_frames, 1, 1000, "",
            "Maximum number of frames that are fitted, evenly spread over the sequence");
  return table;
}

void require_measurable(const PersonalizeStageOptions& options,
                        const std::filesystem::path& capture,
                        const std::filesystem::path& workspace) {
  const CaptureInfo info = open_dataset(capture, options.input.capture).info;
  if (!info.sequences.empty()) {
    measured_sequence(info, options.sequence);
  }
  require_person(workspace, options.input);
  if (options.body != PersonalizeStageOptions{}.body) {  // which is made, not read
    read_body_file(options.body);
  }
}

void run_personalize(StageRun& run) {
  const auto& options = run.options<PersonalizeStageOptions>();
  const CaptureInfo info = person_capture(person_files(run), options.input);
  if (info.sequences.empty()) {
    throw DataError(run.input("capture").string(), "sequences", "none", "at least one");
  }
  const CaptureSequence sequence =
      thinned(measured_sequence(info, options.sequence), options.max_frames);
  const bool minimal = sequence.kind == "minimal";
  if (!minimal) {
    run.warn("the sequence '" + sequence.name +
             "' is not minimally clothed: the shape comes from bare skin and keypoints alone, "
             "which is less exact; a sequence of kind \"minimal\" gives all of it");
  }
  const BodyModel body = read_body_file(options.body).model;
  const PersonEvidence evidence = person_input(person_files(run), info, sequence, options.input);
  tell(run, evidence.findings);
  const Personalization found = personalize(body, evidence.input, options.fit);
  tell(run, found.findings);
  const PersonalBody& person = found.person;
  run.output("person.npz",
             [&](const std::filesystem::path& file) { write_personal_body(file, person); });
  nlohmann::ordered_json shape = nlohmann::ordered_json::object();
  for (std::size_t s = 0; s < person.shape_names.size(); ++s) {
    shape[person.shape_names[s]] = person.shape[static_cast<Index>(s)];
  }
  run.output_text("shape.json", shape.dump(1) + "\n");
  const Eigen::VectorXd areas = vertex_areas(person.model.mesh.vertices, person.model.mesh.faces);
  run.metric("frames", static_cast<double>(sequence.frame_ids.size()));
  run.metric("minimal", minimal ? 1 : 0);
  const bool met = found.scan_rms > 0;  // else nothing was measured, which is no 0
  if (met) {
    run.metric("scan_rms", found.scan_rms);
  }
  run.metric("keypoint_rms", found.keypoint_rms);
  if (met) {
    run.metric("displacement_rms",
               std::sqrt(areas.dot(person.displacements.rowwise().squaredNorm()) / areas.sum()));
  }
  run.metric("unseen_share", found.unseen);
}

}  // namespace atelier
