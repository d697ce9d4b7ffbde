#include "pipeline/stages/option_rules.h"

#include <algorithm>

#include "pipeline/stages/stages.h"

namespace atelier {

std::vector<std::string> broken_rules(const OptionTable& table) {
  std::vector<const OptionRules*> judged;  // what several stages share, once
  std::vector<std::string> problems;
  for (const StageRow* row : all_rows()) {
    if (row->rules == nullptr ||
        std::find(judged.begin(), judged.end(), row->rules) != judged.end()) {
      continue;
    }
    judged.push_back(row->rules);
    for (std::string& problem : broken_rules(table, *row->rules)) {
      problems.push_back(std::move(problem));
    }
  }
  return problems;
}

}  // namespace atelier
