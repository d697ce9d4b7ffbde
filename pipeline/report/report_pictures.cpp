#include "pipeline/report/report_pictures.h"

#include "core/error.h"
#include "pipeline/pictures/report_page.h"
#include "pipeline/stages/stages.h"

namespace atelier {

std::map<std::string, std::string> stage_pictures(std::span<const StageStatus> stages,
                                                  const std::filesystem::path& workspace) {
  std::map<std::string, std::string> pictures;
  for (const StageStatus& status : stages) {
    const StageRow* row = find_row(status.stage);
    if (row == nullptr || row->pictures == nullptr || !status.manifest ||
        status.state == StageStatus::State::Damaged) {
      continue;
    }
    try {
      pictures[status.stage] = row->pictures(status, ReportPlaces{workspace, stages});
    } catch (const DataError& error) {  // an image less is no reason for no report
      pictures[status.stage] =
          "<p class=\"warning\">Images could not be drawn: " + html_text(error.what()) + "</p>\n";
    }
  }
  return pictures;
}

}  // namespace atelier
