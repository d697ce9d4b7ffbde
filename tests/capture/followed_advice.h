#pragma once

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "capture/layouts/open_dataset.h"
#include "capture/try_corrections.h"
#include "capture/validate.h"

namespace atelier::fixtures {

using CorrectionSet = std::map<std::string, std::string>;

inline std::string all_lines(const std::vector<Finding>& findings) {
  std::string text;
  for (const Finding& finding : findings) {
    text += "  " + to_string(finding) + "\n";
  }
  return text;
}

/// A capture opened as a user does who follows all advice, until there is none.
struct Followed {
  CorrectionSet corrections;
  std::vector<Finding> findings;
  Dataset dataset;
};

inline Followed follow(const std::filesystem::path& folder, CorrectionSet corrections = {}) {
  DatasetOptions options;
  const auto open = [&](const CorrectionSet& some) {
    options.corrections = corrections_of(some);
    return open_dataset(folder, options);
  };
  for (int round = 0;; ++round) {
    FrameReader reader(without_wrong_corrections(open(corrections), open));
    const std::vector<Finding> findings =
        with_advice_that_joins(validate(reader).findings, reader.dataset(), open);
    CorrectionSet more = corrections;
    const std::string up = options.up;
    const double unit = options.metres_per_unit;
    for (const std::string& setting : settings_of(findings)) {
      const std::size_t space = setting.find(' ');
      std::string option = setting.substr(0, space).substr(std::string("--capture.").size());
      std::replace(option.begin(), option.end(), '-', '_');
      const std::string value = setting.substr(space + 1);
      if (option == "up") {
        options.up = value;
      } else if (option == "metres_per_unit") {
        options.metres_per_unit = std::strtod(value.c_str(), nullptr);
      } else {
        more[option] = value;
      }
    }
    const bool all_set = more == corrections && options.up == up && options.metres_per_unit == unit;
    if (all_set || round == 4) {
      EXPECT_LT(round, 4) << "advice goes round:\n" << all_lines(findings);
      return {corrections, findings, reader.dataset()};
    }
    corrections = more;
  }
}

}  // namespace atelier::fixtures
