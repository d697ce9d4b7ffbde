#include "pipeline/pictures/report_summary.h"

#include <algorithm>
#include <cstdint>

#include "core/printable.h"
#include "core/store/input_errors.h"
#include "pipeline/pictures/report_page.h"

namespace atelier {
namespace {

constexpr std::size_t kBest = 2;   // figures that are named as good
constexpr std::size_t kWorst = 3;  // and as not good

std::string sentence(const char* lead, const std::string& text) {
  return std::string("<p><b>") + lead + ":</b> " + html_text(text) + ".</p>\n";
}

/// A result that is as it was made, and that says nothing against what it was made of.
bool is_sound(const StageStatus& status) {
  return status.state == StageStatus::State::Done &&
         (!status.manifest || status.row == nullptr ||
          input_errors_text(*status.row, *status.manifest).empty());
}

/// "distance of the body from the true one, 8 mm (at most 6)".
std::string figure_text(const Gauge& gauge) {
  return (gauge.words.empty() ? gauge.name : gauge.words) + " " + gauge.value + " (" + gauge.range +
         ")";
}

/// Those that meet their targets, or those that do not; the farthest from its target first.
std::vector<const Gauge*> sorted(std::span<const Gauge> gauges, bool met) {
  std::vector<const Gauge*> some;
  for (const Gauge& gauge : gauges) {
    if (gauge.met == met) {
      some.push_back(&gauge);
    }
  }
  std::stable_sort(some.begin(), some.end(), [&](const Gauge* a, const Gauge* b) {
    return met ? share_of_allowed(*a) < share_of_allowed(*b)
               : share_of_allowed(*a) > share_of_allowed(*b);
  });
  return some;
}

std::string good_sentence(const SummaryFacts& facts, std::size_t sound) {
  std::string text = sound == 0 ? "no stage has a sound result yet"
                                : counted(static_cast<std::int64_t>(sound), "stage") +
                                      (sound == 1 ? " has a sound result" : " have sound results");
  const std::vector<const Gauge*> met = sorted(facts.gauges, true);
  if (facts.gauges.empty()) {
    return text;
  }
  text += met.empty() ? ", no figure meets its target"
                      : ", " + std::to_string(met.size()) + " of " +
                            counted(static_cast<std::int64_t>(facts.gauges.size()), "figure") +
                            (met.size() == 1 ? " meets its target" : " meet their targets");
  std::vector<std::string> best;
  for (const Gauge* gauge : met) {  // one on its very limit is not what is best
    if (best.size() < kBest && share_of_allowed(*gauge) < 1) {
      best.push_back(figure_text(*gauge));
    }
  }
  return text + (best.empty() ? "" : ", best " + some_of(best, kBest));
}

std::string bad_sentence(const SummaryFacts& facts) {
  std::vector<std::string> parts;
  std::vector<std::string> worst;
  for (const Gauge* gauge : sorted(facts.gauges, false)) {
    worst.push_back(figure_text(*gauge));
  }
  if (!worst.empty()) {
    parts.push_back(some_of(worst, kWorst));
  }
  std::vector<std::string> unsound;
  for (const StageStatus& status : facts.stages) {
    if (status.state != StageStatus::State::Done && status.state != StageStatus::State::None) {
      unsound.push_back(status.stage + " is " + state_name(status.state));
    } else if (!is_sound(status) && status.state == StageStatus::State::Done) {
      unsound.push_back(status.stage + " ended with errors of what it was given, " +
                        input_errors_text(*status.row, *status.manifest));
    }
  }
  if (!unsound.empty()) {
    parts.push_back(some_of(unsound, kWorst));
  }
  std::string listed;
  if (facts.errors > 0) {
    listed = counted(static_cast<std::int64_t>(facts.errors), "error");
  }
  if (facts.warnings > 0) {
    listed += (listed.empty() ? "" : " and ") +
              counted(static_cast<std::int64_t>(facts.warnings), "warning");
  }
  if (!listed.empty()) {
    parts.push_back(listed + (facts.errors + facts.warnings == 1 ? " asks" : " ask") +
                    " for attention, below");
  }
  std::string text;
  for (const std::string& part : parts) {
    text += (text.empty() ? "" : "; ") + part;
  }
  return text.empty() ? "nothing that was checked" : text;
}

std::string unknown_sentence(const SummaryFacts& facts) {
  const std::vector<std::string> unknown(facts.unknown.begin(), facts.unknown.end());
  return !unknown.empty()       ? some_of(unknown, kWorst)
         : facts.gauges.empty() ? "whether the results are good, since no figure of theirs has a "
                                  "target"
                                : "nothing that has a target";
}

}  // namespace

std::string some_of(const std::vector<std::string>& names, std::size_t most) {
  std::string text;
  const std::size_t shown = std::min(names.size(), most);
  for (std::size_t i = 0; i < shown; ++i) {
    const bool last = i + 1 == names.size();
    text += (i == 0 ? "" : last ? " and " : ", ") + names[i];
  }
  return text +
         (shown < names.size() ? " and " + std::to_string(names.size() - shown) + " more" : "");
}

std::string report_summary(const SummaryFacts& facts) {
  const auto sound = static_cast<std::size_t>(
      std::count_if(facts.stages.begin(), facts.stages.end(),
                    [](const StageStatus& status) { return is_sound(status); }));
  return "<div class=\"summary\">\n" + sentence("Good", good_sentence(facts, sound)) +
         sentence("Not good", bad_sentence(facts)) +
         sentence("Not known", unknown_sentence(facts)) + "</div>\n";
}

}  // namespace atelier
