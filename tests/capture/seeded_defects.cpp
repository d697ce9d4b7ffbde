#include "tests/capture/seeded_defects.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "capture/layouts/open_dataset.h"
#include "capture/validate.h"
#include "core/options.h"

namespace atelier::fixtures {

std::vector<SeededDefect> all_defects() {
  std::vector<SeededDefect> all = calibration_defects();
  for (const auto& more : {picture_defects(), detection_defects()}) {
    all.insert(all.end(), more.begin(), more.end());
  }
  return all;
}

void write_spoiled(const SeededDefect& defect, Spoiled spoiled) {
  if (defect.spoil != nullptr) {
    defect.spoil(spoiled);
  }
  write_seeded(spoiled.capture, spoiled.folder);
  if (defect.spoil_files != nullptr) {
    defect.spoil_files(spoiled);
  }
}

std::vector<Finding> findings_of(const std::filesystem::path& folder, const std::string& setting) {
  DatasetOptions options;
  if (const std::size_t space = setting.find(' '); space != std::string::npos) {
    OptionTable table = describe(options);
    std::string name =
        setting.substr(std::string("--capture.").size(), space - std::string("--capture.").size());
    std::replace(name.begin(), name.end(), '-', '_');
    EXPECT_EQ(set_option(table, name, setting.substr(space + 1)), "");
  }
  FrameReader reader(open_dataset(folder, options));
  return validate(reader).findings;
}

bool names(const Finding& finding, const SeededDefect& defect) {
  return finding.code == defect.code &&
         (*defect.place == '\0' || finding.place == defect.place ||
          finding.place.starts_with(std::string(defect.place) + " "));
}

bool blames_another(const Finding& finding, const SeededDefect& defect) {
  return std::string(defect.place).starts_with("cam") &&
         std::string(defect.setting).find(',') == std::string::npos &&
         finding.severity == Severity::Error && finding.place.starts_with("cam") &&
         !finding.place.starts_with(std::string(defect.place).substr(0, 4));
}

}  // namespace atelier::fixtures
