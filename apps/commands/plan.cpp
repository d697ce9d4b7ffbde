#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>

#include "apps/commands/chain_run.h"
#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/option_flags.h"
#include "apps/console/stage_command.h"
#include "core/exit_code.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/store/workspace_folder.h"
#include "core/usage_error.h"
#include "pipeline/chain/plan_jobs.h"
#include "pipeline/chain/run_chain.h"
#include "pipeline/chain/run_options.h"
#include "pipeline/chain/take_facts.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

struct PlanArguments {
  RunPlaces places;
  PlanOptions plan;
  std::string take;  ///< "200x10000x4"; "": CAPTURE is opened
  std::string device = "cpu";
  std::string material;
  bool json = false;
};

void show(const std::vector<PlannedJob>& jobs) {
  double sum = 0;
  for (const PlannedJob& job : jobs) {
    std::string name = job.id;
    name.resize(std::max<std::size_t>(name.size(), 16), ' ');
    std::cout << "  " << name << " about " << duration_text(job.seconds) << ", "
              << bytes_text(1e6 * job.megabytes);
    for (std::size_t i = 0; i < job.needs.size(); ++i) {
      std::cout << (i == 0 ? ", after " : " ") << job.needs[i];
    }
    std::cout << "\n";
    sum += job.seconds;
  }
  std::cout << "plan: " << counted(static_cast<std::int64_t>(jobs.size()), "job") << ", about "
            << duration_text(sum) << " of work, " << duration_text(longest_way(jobs))
            << " where each begins as soon as it may\n";
}

int plan(PlanArguments arguments, OptionSet options) {
  RunPlaces& places = arguments.places;
  if (places.capture.empty() || places.workspace.empty()) {
    throw UsageError("plan takes CAPTURE and WORKSPACE: atelier plan CAPTURE WORKSPACE");
  }
  places.workspace = workspace_place(places.workspace);
  require_stage_places(places.capture, places.workspace);
  require_folder_or_nothing(places.workspace);
  places.capture = fs::absolute(places.capture);
  places.workspace = fs::absolute(places.workspace);
  arguments.plan.cuda = arguments.device == "cuda";
  arguments.plan.words = given_flags(options.table);
  if (!arguments.material.empty()) {
    set_material(options, arguments.material);  // refuses what no job would take
    arguments.plan.words.insert(arguments.plan.words.end(), {"--material", arguments.material});
  }
  const CaptureFacts facts =
      arguments.take.empty()
          ? capture_facts(places.capture,
                          options_of<DatasetOptions>(options_of<RunOptions>(options).capture))
          : facts_of_take(arguments.take);
  const std::vector<PlannedJob> jobs = plan_jobs(places, facts, arguments.plan);
  if (!arguments.json) {
    show(jobs);
    return kExitDone;
  }
  std::cout << plan_json(places, jobs) << "\n";
  return kExitDone;
}

std::string count_problem(const std::string& text) {
  return text == "0" ? "it takes 1 or more" : jobs_problem(text);
}

}  // namespace

Action add_plan(CLI::App& parser) {
  auto arguments = std::make_shared<PlanArguments>();
  add_option(
      parser, "CAPTURE", [arguments](const std::string& text) { arguments->places.capture = text; },
      "Capture to read")
      .required();
  add_option(
      parser, "WORKSPACE",
      [arguments](const std::string& text) { arguments->places.workspace = text; },
      "Folder of results")
      .required();
  add_option(parser, "--from", arguments->plan.from, "First stage [validate]")
      .check(one_of(step_names()))
      .type_name("STAGE");
  add_option(parser, "--to", arguments->plan.to, "Last stage before the report [all]")
      .check(one_of(step_names()))
      .type_name("STAGE");
  add_option(parser, "--parts", arguments->plan.parts,
             "Number of jobs that share the frames of each stage that can be divided")
      .check(count_problem)
      .type_name("N");
  add_option(parser, "--threads", arguments->plan.threads, "Number of processor cores of a job")
      .check(count_problem)
      .type_name("N");
  add_option(parser, "--device", arguments->device, "Device of the stages that support both")
      .check(one_of({"cpu", "cuda"}))
      .type_name("cpu|cuda");
  add_option(parser, "--material", arguments->material,
             "Fabric of all garments instead of a fitted one")
      .type_name("NAME");
  add_option(
      parser, "--take", arguments->take,
      "Take that is not there yet, instead of what CAPTURE holds: its cameras, frames, and the "
      "megapixels of an image")
      .type_name("CxFxM");
  add_flag(parser, "--json", arguments->json, "Output as JSON, for workflow engines");
  const OptionReader options = add_option_flags(parser, run_options(), "");
  return [arguments, options] { return plan(*arguments, options()); };
}

}  // namespace atelier
