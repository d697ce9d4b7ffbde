#include "capture/time_stamp.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <string_view>

#include "capture/frame_number.h"

namespace atelier {
namespace {

using Runs = std::vector<std::string_view>;

constexpr std::int64_t kSecond = 1'000'000'000;  // nanoseconds
constexpr std::size_t kFractionDigits = 9;

/// Nanoseconds of the digits behind the decimal point.
std::int64_t fraction_of(std::string_view digits) {
  std::string padded(digits);
  padded.resize(kFractionDigits, '0');
  return long_number(padded).value_or(0);
}

std::optional<std::int64_t> decimal_seconds(const Runs& runs) {
  constexpr std::size_t kDigits = 10;  // from 2001 to 2286
  if (runs.size() < 2 || runs[runs.size() - 2].size() != kDigits ||
      runs.back().size() > kFractionDigits) {
    return std::nullopt;
  }
  const std::string_view seconds = runs[runs.size() - 2];
  const char* end = seconds.data() + seconds.size();
  if (*end != '.' || end + 1 != runs.back().data()) {
    return std::nullopt;
  }
  return long_number(seconds).value_or(0) * kSecond + fraction_of(runs.back());
}

/// "20261129142601" as nanoseconds since 1970; nothing of digits that are no date and time.
std::optional<std::int64_t> seconds_of_date(std::string_view digits) {
  const auto part = [&](std::size_t at, std::size_t length) {
    return static_cast<int>(long_number(digits.substr(at, length)).value_or(-1));
  };
  const std::chrono::year_month_day day(std::chrono::year(part(0, 4)),
                                        std::chrono::month(static_cast<unsigned>(part(4, 2))),
                                        std::chrono::day(static_cast<unsigned>(part(6, 2))));
  constexpr int kFirstYear = 1971;
  constexpr int kLastYear = 2199;
  const int hour = part(8, 2);
  const int minute = part(10, 2);
  const int second = part(12, 2);
  if (!day.ok() || part(0, 4) < kFirstYear || part(0, 4) > kLastYear || hour > 23 || minute > 59 ||
      second > 60) {
    return std::nullopt;
  }
  const std::int64_t days = std::chrono::sys_days(day).time_since_epoch().count();
  return (((days * 24 + hour) * 60 + minute) * 60 + second) * kSecond;
}

/// A date and a time of day.
struct DateTime {
  std::int64_t second = 0;    ///< ns, whole seconds
  std::int64_t fraction = 0;  ///< ns
  std::int64_t counted = -1;  ///< the digits of the fraction as a number; -1: there are none
  bool decimal = false;       ///< whether a decimal point is before them
};

/// How digits of date and time may be parted: by all parts, in two, not at all.
constexpr std::array<std::array<std::size_t, 6>, 5> kParts = {{{4, 2, 2, 2, 2, 2},
                                                               {8, 6, 0, 0, 0, 0},
                                                               {8, 2, 2, 2, 0, 0},
                                                               {4, 2, 2, 6, 0, 0},
                                                               {14, 0, 0, 0, 0, 0}}};

/// Date and time in the runs from `first` on, to the last one, with at most a fraction behind them;
/// the last part may have milliseconds or microseconds at its end without anything between.
std::optional<DateTime> date_time_from(const Runs& runs, std::size_t first,
                                       const std::array<std::size_t, 6>& parts) {
  const auto count = static_cast<std::size_t>(
      std::count_if(parts.begin(), parts.end(), [](std::size_t part) { return part > 0; }));
  if (first + count > runs.size() || first + count + 1 < runs.size()) {
    return std::nullopt;
  }
  std::string digits;
  std::string_view fraction;
  bool decimal = false;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string_view run = runs[first + i];
    const bool last = i + 1 == count;
    const bool glued = last && (run.size() == parts[i] + 3 || run.size() == parts[i] + 6);
    const bool parted = i == 0 || runs[first + i - 1].data() + runs[first + i - 1].size() + 1 ==
                                      run.data();  // one character between
    if (!parted || (run.size() != parts[i] && !glued)) {
      return std::nullopt;
    }
    digits += run.substr(0, parts[i]);
    fraction = run.substr(parts[i]);
  }
  if (first + count < runs.size()) {
    const std::string_view behind = runs.back();
    const std::string_view before = runs[first + count - 1];
    const char* end = before.data() + before.size();
    decimal = *end == '.' || *end == ',';
    const bool whole = behind.size() % 3 == 0;  // milliseconds, micro-, nanoseconds
    if (!fraction.empty() || end + 1 != behind.data() || behind.size() > kFractionDigits ||
        !(decimal || whole)) {
      return std::nullopt;
    }
    fraction = behind;
  }
  // Six digits behind a date may as well be a frame's number, which serves as one.
  const bool time_in_one = count < 6 && parts[count - 1] == 6;
  const std::optional<std::int64_t> second = seconds_of_date(digits);
  if (!second || (time_in_one && fraction.empty())) {
    return std::nullopt;
  }
  return DateTime{*second, fraction_of(fraction),
                  fraction.empty() ? -1 : long_number(fraction).value_or(-1), decimal};
}

std::optional<DateTime> date_time(const Runs& runs) {
  for (const auto& parts : kParts) {
    for (std::size_t first = runs.size() > 7 ? runs.size() - 7 : 0; first < runs.size(); ++first) {
      if (const auto found = date_time_from(runs, first, parts)) {
        return found;
      }
    }
  }
  return std::nullopt;
}

/// Whether what looks like fractions is a camera's number: the same everywhere.
bool have_one_number(const std::vector<DateTime>& times) {
  const DateTime& first = times.front();
  return times.size() > 1 && !first.decimal && first.counted >= 0 &&
         std::all_of(times.begin(), times.end(),
                     [&](const DateTime& time) { return time.counted == first.counted; });
}

/// Whether times of one second count on by one behind it.
bool is_counter(const std::vector<DateTime>& times) {
  std::vector<std::int64_t> numbers;
  for (const DateTime& time : times) {
    if (time.second != times.front().second) {
      return false;
    }
    numbers.push_back(time.counted);
  }
  std::sort(numbers.begin(), numbers.end());
  for (std::size_t i = 1; i < numbers.size(); ++i) {
    if (numbers[i] - numbers[i - 1] <= 1) {
      return true;
    }
  }
  return false;
}

}  // namespace

std::vector<std::optional<std::int64_t>> time_stamps(const std::vector<std::string>& names) {
  std::vector<std::optional<std::int64_t>> stamps(names.size());
  std::vector<DateTime> dates;
  bool all_dates = true;
  for (std::size_t i = 0; i < names.size(); ++i) {
    Runs runs = digit_runs(names[i]);
    if (!runs.empty() && is_camera_number(names[i], runs.back())) {
      runs.pop_back();
    }
    stamps[i] = decimal_seconds(runs);
    if (const auto found = stamps[i] || !all_dates ? std::nullopt : date_time(runs)) {
      dates.push_back(*found);
    } else {
      all_dates = false;
    }
  }
  if (all_dates && !dates.empty() && !is_counter(dates) && !have_one_number(dates)) {
    for (std::size_t i = 0; i < names.size(); ++i) {
      stamps[i] = dates[i].second + dates[i].fraction;
    }
  }
  return stamps;
}

}  // namespace atelier
