#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "core/io/file_bytes.h"
#include "core/store/frame_left_out.h"
#include "core/store/stage.h"
#include "core/store/workspace_status.h"
#include "core/store/write_text.h"

namespace atelier::fixtures {

/// What the test stages do besides their work; each test sets it anew.
struct Behaviour {
  std::atomic<int> count_runs = 0;
  std::function<void()> during;  ///< called in the middle of `count`
  std::function<void(StageRun&)>
      reports;  ///< progress of `count`, in place of its own; of `frames`, in front of the first
  std::function<void(int)> before_frame;  ///< called before a frame of `frames` is written
  std::int64_t space = 0;                 ///< that `count` needs
  bool asks_to_stop = false;
  std::vector<int> frame_ids = {0, 1, 2, 3, 5, 8};
  std::vector<int> warned_frames;
  std::vector<int> left_out_frames;
  std::vector<int> written;  ///< frames, in order
  std::mutex mutex;

  Behaviour& operator=(const Behaviour& other) {
    count_runs = other.count_runs.load();
    during = other.during;
    reports = other.reports;
    before_frame = other.before_frame;
    space = other.space;
    asks_to_stop = other.asks_to_stop;
    frame_ids = other.frame_ids;
    warned_frames = other.warned_frames;
    left_out_frames = other.left_out_frames;
    written = other.written;
    return *this;
  }
};

inline Behaviour& behaviour() {
  static Behaviour one;
  return one;
}

struct CountOptions {
  std::string word = "files";
  double scale = 1;
  int threads = 1;
};

inline OptionTable describe(CountOptions& options) {
  OptionTable table;
  table.add("word", options.word, {}, "What is counted");
  table.add("scale", options.scale, 0, 10, "", "Has no effect");
  table.add("threads", options.threads, 1, 64, "", "Has no effect and no part in the key")
      .not_keyed();
  return table;
}

inline void run_count(StageRun& run) {
  ++behaviour().count_runs;
  run.need_space(behaviour().space);
  std::int64_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(run.input("texts"))) {
    files += entry.path().extension() == ".txt" ? 1 : 0;
  }
  if (behaviour().during) {
    behaviour().during();
  }
  if (behaviour().asks_to_stop && run.stop_requested()) {
    return;
  }
  if (behaviour().reports) {
    behaviour().reports(run);
  } else {
    run.progress(files, files, "files");
  }
  run.output_text("count.txt", std::to_string(files) + " " + run.options<CountOptions>().word);
  run.metric("files", static_cast<double>(files));
}

inline void run_double(StageRun& run) {
  const std::string text = read_file_text(run.input("counts") / "count.txt", 1000);
  run.output_text("double.txt", text + text);
}

inline void run_either(StageRun& run) {
  std::string text = run.has_input("counts") ? "counted" : "not counted";
  if (const std::string& word = run.options<CountOptions>().word; std::filesystem::exists(word)) {
    text += ", " + read_file_text(word, 1000);
  }
  run.output_text("either.txt", text);
}

inline void run_twins(StageRun& run) {
  run.output_text("device.txt", device_name(run.device()));
}

inline void run_frames(StageRun& run) {
  const bool complete =
      run.each_frame("frames", ".txt", behaviour().frame_ids,
                     [&](int frame_id, const std::filesystem::path& file) {
                       if (behaviour().before_frame) {
                         behaviour().before_frame(frame_id);
                       }
                       if (frame_id == behaviour().frame_ids.front() && behaviour().reports) {
                         behaviour().reports(run);
                       }
                       {
                         const std::lock_guard lock(behaviour().mutex);
                         behaviour().written.push_back(frame_id);
                       }
                       if (std::ranges::count(behaviour().warned_frames, frame_id) > 0) {
                         run.warn("frame " + std::to_string(frame_id) + " is doubtful");
                       }
                       if (std::ranges::count(behaviour().left_out_frames, frame_id) > 0) {
                         throw FrameLeftOut();
                       }
                       write_text(file, "frame " + std::to_string(frame_id));
                     });
  if (!complete) {
    return;
  }
  std::string all;
  for (const int frame_id : behaviour().frame_ids) {
    if (std::filesystem::exists(run.frame_file(frame_id))) {
      all += read_file_text(run.frame_file(frame_id), 1000) + "\n";
    }
  }
  run.output_text("all.txt", all);
}

inline constexpr std::array kCountMetrics = {
    StageMetric{"files", ""},
    StageMetric{"length", "m"},
    StageMetric{.name = "bad", .unit = "", .input_errors = true},
};

inline constexpr std::array kTestStages = {
    Stage{.name = "count",
          .version = 2,
          .summary = "counts files",
          .inputs = {"texts"},
          .outputs = {"counts"},
          .metrics = kCountMetrics,
          .options = option_set<CountOptions>,
          .run = run_count},
    Stage{.name = "double",
          .version = 1,
          .summary = "writes it twice",
          .inputs = {"counts"},
          .outputs = {"doubles"},
          .options = option_set<CountOptions>,
          .run = run_double},
    Stage{.name = "either",
          .version = 1,
          .summary = "does with and without",
          .inputs = {"texts"},
          .optional_inputs = {"counts", "what no stage makes"},
          .outputs = {"eithers"},
          .options = option_set<CountOptions>,
          .file_options = {"word"},
          .run = run_either},
    Stage{.name = "twins",
          .version = 1,
          .summary = "writes its device",
          .inputs = {"texts"},
          .outputs = {"devices"},
          .options = option_set<CountOptions>,
          .run = run_twins,
          .has_cuda = true,
          .device_keyed = true},
    Stage{.name = "frames",
          .version = 1,
          .summary = "writes frames",
          .inputs = {"texts"},
          .outputs = {"frames"},
          .options = option_set<CountOptions>,
          .run = run_frames,
          .frame_wise = true},
};

/// What is said of one stage of the table.
inline const StageStatus& status_of(const std::vector<StageStatus>& all, std::string_view stage) {
  return *std::find_if(all.begin(), all.end(),
                       [&](const StageStatus& status) { return status.stage == stage; });
}

}  // namespace atelier::fixtures
