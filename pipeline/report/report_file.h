#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/store/workspace_status.h"
#include "pipeline/pictures/report_page.h"

namespace atelier {

/// Makes the report on a workspace and writes it: every byte of the results is compared first, a
/// image that is shown as a result must be that result's.
/// @param page   file to write; its folder is made if it is WORKSPACE/report
/// @param truth  synthetic capture that the results were made from: figures against its ground
/// truth are
///               shown; "": none
/// Returns what the page says of each stage. Throws as `report_page`, `workspace_figures` and
/// `require_file_place` do.
std::vector<StageStatus> write_report(const std::filesystem::path& workspace,
                                      const std::filesystem::path& page,
                                      const ReportOptions& options, const std::string& truth);

}  // namespace atelier
