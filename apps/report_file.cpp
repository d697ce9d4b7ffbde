#include "apps/report_file.h"

#include <cstdio>
#include <optional>

#include "apps/evaluation.h"
#include "apps/output_place.h"
#include "apps/report_folder.h"
#include "apps/report_pictures.h"
#include "apps/run_account.h"
#include "apps/stages.h"
#include "apps/targets.h"
#include "core/atomic_file.h"
#include "core/error.h"

namespace atelier {
namespace {

/// Figures of the workspace's results against the truth of their capture; none without one.
std::vector<ReportFigure> figures_of([[maybe_unused]] const std::filesystem::path& workspace,
                                     const std::string& truth) {
  std::vector<ReportFigure> figures;
#ifdef ATELIER_HAS_CAPTURE
  if (!truth.empty()) {
    const Targets targets = targets_named("auto", truth);
    const WorkspaceFigures measured = workspace_figures(workspace, truth);
    for (const Measure& one : measured.measures) {
      const Measure measure = against(one, targets);
      char value[60];
      std::snprintf(value, sizeof(value), "%.4g %s", measure.value, measure.unit.c_str());
      figures.push_back({measure.key, value, verdict_of(measure), is_met(measure), measure.note});
    }
    for (const Unmeasured& one : measured.unmeasured) {
      figures.push_back({one.stage, "-", "", true, "not measured: " + one.why});
    }
  }
#endif
  return figures;
}

}  // namespace

std::vector<StageStatus> write_report(const std::filesystem::path& workspace,
                                      const std::filesystem::path& page,
                                      const ReportOptions& options, const std::string& truth) {
  std::vector<StageStatus> stages = workspace_status(all_stages(), workspace, Check::Digests);
  std::optional<FileLock> lock;
  if (page.parent_path() == report_folder(workspace)) {
    lock = lock_report_folder(workspace);
  }
  require_file_place(page);
  require_outside_inputs(page, stages, "--out");
  std::optional<RunAccount> account;
  std::string account_problem;
  try {
    account = read_run_account(workspace);
  } catch (const DataError& error) {  // the results are as good without it
    account_problem = std::string("what the last run came to cannot be read: ") + error.what();
  }
  write_file_atomically(
      page, report_page(stages, workspace, options, figures_of(workspace, truth), account,
                        stage_pictures(stages, workspace), account_problem));
  return stages;
}

}  // namespace atelier
