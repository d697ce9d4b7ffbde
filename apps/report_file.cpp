#include "apps/report_file.h"

#include <cstdio>

#include "apps/evaluation.h"
#include "apps/output_place.h"
#include "apps/run_account.h"
#include "apps/stages.h"
#include "core/atomic_file.h"

namespace atelier {
namespace {

/// Figures of the workspace's results against the truth of their capture; none without one.
std::vector<ReportFigure> figures_of([[maybe_unused]] const std::filesystem::path& workspace,
                                     const std::string& truth) {
  std::vector<ReportFigure> figures;
#ifdef ATELIER_HAS_CAPTURE
  if (!truth.empty()) {
    for (const Measure& measure : workspace_measures(workspace, truth)) {
      char value[60];
      std::snprintf(value, sizeof(value), "%.4g %s", measure.value, measure.unit.c_str());
      figures.push_back({measure.key, value, verdict_of(measure), is_met(measure), measure.note});
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
  if (page.parent_path() == workspace / "report") {
    make_private_directory(page.parent_path());
  }
  require_file_place(page);
  write_file_atomically(page, report_page(stages, workspace, options, figures_of(workspace, truth),
                                          read_run_account(workspace)));
  return stages;
}

}  // namespace atelier
