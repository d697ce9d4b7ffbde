#include <chrono>
#include <cstdio>
#include <iostream>
#include <memory>

#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/interrupt.h"
#include "apps/console/option_flags.h"
#include "capture/layouts/write_layout.h"
#include "core/exit_code.h"
#include "core/printable.h"
#include "core/store/workspace_folder.h"
#include "core/usage_error.h"
#include "core/writable_place.h"
#include "pipeline/synthesis/synthesis.h"

namespace atelier {
namespace {

/// The preset, with what flags and files changed of it.
SynthesisOptions chosen(const std::string& preset, const OptionSet& set) {
  SynthesisOptions options = preset_options(preset);
  OptionTable table = describe(options);
  for (const OptionField& field : set.table.fields) {
    if (field.source != "default") {
      set_option(table, field.name, option_text(field), field.source);
    }
  }
  const std::vector<std::string> problems = impossible_options(options);
  if (!problems.empty()) {
    throw UsageError(problems);
  }
  return options;
}

void write_other_layout(const std::filesystem::path& capture, const std::string& layout) {
  const std::filesystem::path out = capture / layout;
  if (std::filesystem::exists(out)) {
    std::cout << printable(out.string()) << " already exists\n";
    return;
  }
  // Under another name until it is whole: a layout that was interrupted is recomputed.
  const std::filesystem::path unfinished = capture / ("." + layout + ".unfinished");
  std::filesystem::remove_all(unfinished);
  const LayoutReport report = write_layout(capture, layout, unfinished);
  std::filesystem::rename(unfinished, out);
  for (const std::string& sentence : report.lost) {
    std::cout << "  " << layout << ": " << sentence << "\n";
  }
  for (const std::filesystem::path& folder : report.folders) {
    const std::filesystem::path inside = folder.lexically_relative(unfinished);
    std::cout << (inside == "." ? out : out / inside).string() << "\n";
  }
}

int run(const std::string& folder, const SynthesisOptions& options, const std::string& layout,
        bool dry_run) {
  if (folder.empty()) {
    throw UsageError("synthesize takes a folder for the capture: atelier synthesize OUT");
  }
  const std::string out = workspace_place(folder).string();
  if (dry_run) {
    require_synthesis(out, options);
    require_folder_place(out);
    std::cout << printable(out) << ": the options are valid\n";
    return kExitDone;
  }
  catch_interrupts();
  const auto begin = std::chrono::steady_clock::now();
  const auto say = [&](const std::string& line) {
    const std::chrono::duration<double> since = std::chrono::steady_clock::now() - begin;
    char time[32];
    std::snprintf(time, sizeof(time), "%6.1f s  ", since.count());
    std::cout << time << printable(line) << std::endl;
  };
  if (!synthesize_capture(out, options, {say, interrupted})) {
    std::cout << "stopped; the same command goes on from here" << std::endl;
    end_by_signal();
  }
  std::cout << printable(out) << "\n";
  if (!layout.empty()) {
    write_other_layout(out, layout);
  }
  return kExitDone;
}

}  // namespace

OptionSet synthesize_options() {
  return option_set<SynthesisOptions>();
}

Action add_synthesize(CLI::App& parser) {
  auto out = std::make_shared<std::string>();
  auto layout = std::make_shared<std::string>();
  auto preset = std::make_shared<std::string>("tiny");
  auto dry_run = std::make_shared<bool>(false);
  add_option(parser, "OUT", *out, "Folder of the capture; created if it is missing").required();
  add_option(parser, "--preset", *preset, "Size of the capture [tiny]")
      .check(one_of(synthesis_presets()))
      .type_name("tiny|demo|accuracy|studio");
  add_option(parser, "--layout", *layout,
             "Additional layout to write to OUT/LAYOUT; convert-capture lists them")
      .check(one_of(layout_names()))
      .type_name("LAYOUT");
  add_flag(parser, "--dry-run", *dry_run,
           "Check whether the options are compatible, without writing anything");
  const OptionReader options = add_option_flags(parser, synthesize_options());
  return [out, preset, layout, dry_run, options] {
    return run(*out, chosen(*preset, options()), *layout, *dry_run);
  };
}

}  // namespace atelier
