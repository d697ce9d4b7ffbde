#include "pipeline/statistics/statistics_stage.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/file_kind.h"
#include "core/io/json.h"
#include "core/io/sequence_folder.h"
#include "core/sequence_archive.h"
#include "core/store/write_text.h"

namespace atelier {
namespace {

bool is_own_sequence(const std::filesystem::path& path) {
  return file_kind(path) == std::filesystem::file_type::directory &&
         file_kind(path / "sequence.h5") != std::filesystem::file_type::not_found;
}

/// Atelier's own sequence, or a folder of mesh files.
Sequence read_meshes(const std::filesystem::path& path, const MeshConvention& otherwise) {
  return is_own_sequence(path) ? open_sequence(path) : read_sequence_folder(path, otherwise);
}

/// The warning where files do not say their unit and what is taken for it is no person's size.
void say_unit(StageRun& run, const MeshConvention& otherwise) {
  const std::filesystem::path& path = run.input("meshes");
  try {
    const MeshFile first = read_first_mesh(path, otherwise);
    const auto finding = unit_finding(first, path.string());
    if (finding) {
      tell(run, {*finding});
    }
    for (const Finding& said : first.findings) {
      if (said.severity != Severity::Note) {
        tell(run, {said});
      }
    }
  } catch (const DataError&) {
    return;  // told of when its frame's turn comes, if it does
  }
}

void say_gaps(StageRun& run, const Sequence& sequence) {
  if (const auto finding = gap_finding(sequence.frame_ids, run.input("meshes").string())) {
    tell(run, {*finding});
  }
}

nlohmann::json json_of(int frame_id, const MeshStatistics& s) {
  nlohmann::json json = {{"frame", frame_id},
                         {"vertices", s.vertices},
                         {"faces", s.faces},
                         {"edges", s.edges},
                         {"components", s.components},
                         {"boundary_loops", s.boundary_loops},
                         {"boundary_length", s.boundary_length},
                         {"non_manifold_edges", s.non_manifold_edges},
                         {"inconsistent_edges", s.inconsistent_edges},
                         {"degenerate_faces", s.degenerate_faces},
                         {"flat_faces", s.flat_faces},
                         {"isolated_vertices", s.isolated_vertices},
                         {"area", s.area},
                         {"lowest", {s.lowest.x(), s.lowest.y(), s.lowest.z()}},
                         {"highest", {s.highest.x(), s.highest.y(), s.highest.z()}},
                         {"edge_lengths", s.edge_lengths}};
  json["volume"] = s.volume ? nlohmann::json(*s.volume) : nlohmann::json(nullptr);
  return json;
}

/// Smallest, mean and largest of every number over the frames, null where no frame has it.
nlohmann::json ranges_of(const nlohmann::json& frames) {
  struct Range {
    double least = 0, sum = 0, most = 0;
    std::int64_t count = 0;
  };
  std::map<std::string, Range> ranges;
  for (const nlohmann::json& frame : frames) {
    for (const auto& item : frame.items()) {
      if (!item.value().is_number() || item.key() == "frame") {
        continue;
      }
      const double value = item.value().get<double>();
      Range& range = ranges[item.key()];
      range.least = range.count == 0 ? value : std::min(range.least, value);
      range.most = range.count == 0 ? value : std::max(range.most, value);
      range.sum += value;
      ++range.count;
    }
  }
  nlohmann::json json = nlohmann::json::object();
  for (const auto& [name, range] : ranges) {
    json[name] = {{"least", range.least},
                  {"mean", range.sum / static_cast<double>(range.count)},
                  {"most", range.most},
                  {"frames", range.count}};
  }
  return json;
}

}  // namespace

OptionTable describe(StatisticsStageOptions& options) {
  OptionTable table;
  table.add("statistics.edge_quantiles", options.statistics.edge_quantiles, 0, 1, "",
            "Quantiles of the edge lengths to report: 0 is the shortest edge, 0.5 the median, 1 "
            "the longest");
  table.add("input", describe(options.input));
  return table;
}

void check_statistics_input(const std::filesystem::path& input, const OptionTable& /*options*/) {
  const std::filesystem::file_type kind = file_kind(input);
  if (kind == std::filesystem::file_type::directory ||
      kind == std::filesystem::file_type::regular) {
    read_meshes(input, {});  // lists the files and their sizes; reads none of them
  }
}

void run_statistics(StageRun& run) {
  const auto& options = run.options<StatisticsStageOptions>();
  const Sequence sequence = read_meshes(run.input("meshes"), options.input);
  if (!is_own_sequence(run.input("meshes"))) {  // which is in metres, and says which frames it has
    say_unit(run, options.input);
    say_gaps(run, sequence);
  }
  const bool complete = run.each_frame(
      "frames", ".json", sequence.frame_ids, [&](int frame_id, const std::filesystem::path& file) {
        const auto at =
            std::lower_bound(sequence.frame_ids.begin(), sequence.frame_ids.end(), frame_id);
        const MeshStatistics statistics =
            mesh_statistics(frame(sequence, at - sequence.frame_ids.begin()), options.statistics);
        write_text(file, json_of(frame_id, statistics).dump(1) + "\n");
      });
  if (!complete) {
    return;
  }
  nlohmann::json all;
  all["schema"] = "atelier-statistics";
  all["schema_version"] = 1;
  all["units"] = "m, m2, m3";
  all["edge_quantiles"] = options.statistics.edge_quantiles;
  all["frames"] = nlohmann::json::array();
  for (const int frame_id : sequence.frame_ids) {
    all["frames"].push_back(read_json(run.frame_file(frame_id)));
  }
  all["ranges"] = ranges_of(all["frames"]);
  run.output_text("statistics.json", all.dump(1) + "\n");
  run.metric("frames", static_cast<double>(sequence.frame_ids.size()));
  for (const char* name : {"vertices", "faces", "area", "boundary_loops", "non_manifold_edges",
                           "inconsistent_edges"}) {
    if (all["ranges"].contains(name)) {
      run.metric(std::string(name) + "_mean", all["ranges"][name]["mean"].get<double>());
    }
  }
}

}  // namespace atelier
