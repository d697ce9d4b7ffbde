#include "pipeline/pattern/pattern_pictures.h"

#include <cstdint>

#include "core/io/file_bytes.h"
#include "pipeline/pictures/report_drawings.h"
#include "pipeline/pictures/report_page.h"

namespace atelier {

std::string pattern_pictures(const StageStatus& own, const ReportPlaces& places) {
  std::string html;
  for (const ManifestOutput& output : own.manifest->outputs) {
    if (!output.path.ends_with("pattern.svg")) {
      continue;
    }
    constexpr std::int64_t kMost = 20'000'000;
    html += "<figure><img style=\"max-height:40rem\" alt=\"" + html_text(output.path) +
            "\" src=\"data:image/svg+xml;base64," +
            base64_text(read_file_bytes(result_folder_of(own, places) / output.path, kMost)) +
            "\"><figcaption>" + html_text(output.path) + ", to scale</figcaption></figure>\n";
  }
  return html;
}

}  // namespace atelier
