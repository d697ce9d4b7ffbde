#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>

#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/interrupt.h"
#include "apps/console/option_flags.h"
#include "apps/console/tell_consent.h"
#include "capture/layouts/join_datasets.h"
#include "capture/layouts/open_dataset.h"
#include "capture/layouts/with_cameras.h"
#include "capture/layouts/write_layout.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/printable.h"
#include "core/store/digest_meter.h"
#include "core/store/output_place.h"
#include "core/store/unfinished_folder.h"
#include "core/usage_error.h"
#include "core/writable_place.h"

namespace atelier {
namespace {

struct ConvertCaptureArguments {
  std::string in;
  std::string out;
  std::vector<std::string> further;  // with --join: captures, then OUT
  std::vector<std::string> join;     // kinds
  std::string to = "native";
  std::string cameras;
};

std::string layout_choices() {
  std::string text;
  for (const std::string& name : layout_names()) {
    text += (text.empty() ? "" : "|") + name;
  }
  return text;
}

/// Writes the layout to ".NAME.unfinished/NAME" beside `out`, and moves it there once it is whole:
/// half a capture looks like a smaller one. Remains of a kill are rewritten. Throws
/// StopRequested.
LayoutReport write_whole(const Dataset& dataset, const std::string& layout,
                         const std::filesystem::path& out) {
  const UnfinishedFolder unfinished(out);
  LayoutReport report = write_layout(dataset, layout, unfinished.content(), interrupted);
  unfinished.finish();
  const auto moved = [&](const std::filesystem::path& path) {
    const std::filesystem::path inside = path.lexically_relative(unfinished.content());
    return inside == "." ? out : out / inside;
  };
  for (std::filesystem::path& path : report.folders) {
    path = moved(path);
  }
  report.consent = report.consent.empty() ? report.consent : moved(report.consent);
  return report;
}

/// The same; ends the program where a signal says so, after the unfinished capture is gone.
LayoutReport write_or_end(const Dataset& dataset, const std::string& layout,
                          const std::filesystem::path& out) {
  catch_interrupts();
  try {
    return write_whole(dataset, layout, out);
  } catch (const StopRequested&) {
    std::cout << "stopped; nothing was written" << std::endl;
    end_by_signal();
  }
}

/// What is read, and what is written: IN and OUT, or with --join all but the last and the last.
struct ConvertedPlaces {
  std::vector<std::string> in;
  std::string out;
};

ConvertedPlaces places_of(const ConvertCaptureArguments& arguments) {
  ConvertedPlaces places{{arguments.in}, arguments.out};
  for (const std::string& path : arguments.further) {
    places.in.push_back(places.out);
    places.out = path;
  }
  if (arguments.join.empty() && !arguments.further.empty()) {
    throw UsageError(
        "convert-capture takes IN and OUT; --join makes one capture of several: "
        "atelier convert-capture A B OUT --join clothed,minimal");
  }
  if (!arguments.join.empty() && places.in.size() != arguments.join.size()) {
    const auto count = [](std::size_t n, const char* noun) {
      return counted(static_cast<std::int64_t>(n), noun);
    };
    throw UsageError("--join names " + count(arguments.join.size(), "kind") + ", and " +
                     count(places.in.size(), "capture") +
                     (places.in.size() == 1 ? " comes" : " come") +
                     " before OUT: it takes a kind for each, as in atelier convert-capture A "
                     "B OUT --join clothed,minimal");
  }
  for (const std::string& in : places.in) {
    require_outside_input(places.out, in, "OUT", "the capture");
  }
  return places;
}

/// Refuses a capture that is there twice, which would double its sequence.
void require_unlike_captures(const std::vector<Dataset>& parts,
                             const std::vector<std::string>& in) {
  for (std::size_t b = 0; b < parts.size(); ++b) {
    for (std::size_t a = 0; a < b; ++a) {
      std::error_code ignored;
      if (std::filesystem::equivalent(in[a], in[b], ignored) || same_images(parts[a], parts[b])) {
        throw UsageError(
            "--join takes each capture once: " + in[b] +
            (in[a] == in[b] ? std::string(" is named twice") : " has the images of " + in[a]));
      }
    }
  }
}

int run(const ConvertCaptureArguments& arguments, const DatasetOptions& options) {
  if (arguments.in.empty() || arguments.out.empty()) {
    throw UsageError("convert-capture takes IN and OUT: atelier convert-capture IN OUT");
  }
  const ConvertedPlaces places = places_of(arguments);
  require_new_place(places.out, "OUT");
  require_folder_place(std::filesystem::absolute(places.out).parent_path());
  std::vector<Dataset> parts;
  std::string name;
  for (const std::string& in : places.in) {
    parts.push_back(open_dataset(in, options));
    name += (name.empty() ? "" : " and ") + in;
  }
  require_unlike_captures(parts, places.in);
  Dataset dataset = arguments.join.empty() ? parts.front() : join_datasets(parts, arguments.join);
  if (!arguments.cameras.empty()) {
    dataset = with_cameras(std::move(dataset), arguments.cameras);
  }
  std::cout << printable(name) << ": " << dataset.layout << " (" << printable(dataset.evidence)
            << "), " << counted(static_cast<std::int64_t>(dataset.cameras.size()), "camera") << ", "
            << counted(static_cast<std::int64_t>(frame_ids(dataset).size()), "frame") << "\n";
  for (const Finding& finding : dataset.findings) {
    std::cout << "  " << printable(to_string(finding)) << "\n";
  }
  tell_ended_consent(dataset);
  const LayoutReport report = write_or_end(dataset, arguments.to, places.out);
  for (const std::string& sentence : report.lost) {
    std::cout << "  " << arguments.to << ": " << sentence << "\n";
  }
  std::cout << "  consent: " << printable(to_string(dataset.info.consent))
            << (report.consent.empty() ? "" : "; kept in " + report.consent.string()) << "\n";
  for (const std::filesystem::path& folder : report.folders) {
    std::cout << printable(folder.string()) << "\n";
  }
  const auto errors =
      std::count_if(dataset.findings.begin(), dataset.findings.end(),
                    [](const Finding& finding) { return finding.severity == Severity::Error; });
  if (errors > 0) {
    std::cout << "written as it was read, with " << counted(errors, "error")
              << " in it: what they advise puts it right\n";
    return kExitBadData;
  }
  return kExitDone;
}

}  // namespace

OptionSet convert_capture_options() {
  return option_set<DatasetOptions>();
}

Action add_convert_capture(CLI::App& parser) {
  auto arguments = std::make_shared<ConvertCaptureArguments>();
  add_option(parser, "IN", arguments->in, "Capture to read: a folder, or a calibration file in it")
      .required();
  add_option(parser, "OUT", arguments->out, "New folder to write").required();
  add_option(parser, "FURTHER", arguments->further, "With --join: further captures, and OUT last");
  add_option(parser, "--join", arguments->join,
             "Kinds of the sequences of several captures of one rig, which become one: "
             "A B OUT --join clothed,minimal")
      .delimiter(',')
      .once_a_flag()
      .type_name("clothed|minimal,...");
  add_option(parser, "--to", arguments->to, "Layout to write [native]")
      .check(one_of(layout_names()))
      .type_name(layout_choices());
  add_option(parser, "--cameras", arguments->cameras,
             "Calibration used instead of that of IN: cameras.json as calibrate writes it")
      .type_name("FILE");
  const OptionReader options = add_option_flags(parser, convert_capture_options());
  return [arguments, options] { return run(*arguments, options_of<DatasetOptions>(options())); };
}

}  // namespace atelier
