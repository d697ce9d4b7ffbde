#include "pipeline/view/view_marks.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstddef>
#include <set>

namespace atelier {

ViewMark mark_of(Severity severity, const std::string& text, const std::string& stage,
                 const std::vector<int>& frame_ids, const std::vector<std::string>& cameras) {
  ViewMark mark{severity, text, stage, std::nullopt, ""};
  std::vector<std::string> words(1);
  std::set<std::size_t> bracketed;  // a finding's place: "camera-off [07]: ..."
  for (const char c : text) {
    if (c == '[') {
      bracketed.insert(words.back().empty() ? words.size() - 1 : words.size());
    }
    const bool in_word = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-';
    if (in_word) {
      words.back() += c;
    } else if (!words.back().empty()) {
      words.emplace_back();
    }
  }
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    int id = -1;
    const bool number =
        !word.empty() && std::from_chars(word.data(), word.data() + word.size(), id).ptr ==
                             word.data() + word.size();
    constexpr std::size_t kFileDigits = 6;
    const bool of_frame = i > 0 && (words[i - 1] == "frame" || words[i - 1] == "frames");
    if (!mark.frame_id && number && (of_frame || word.size() == kFileDigits) &&
        std::binary_search(frame_ids.begin(), frame_ids.end(), id)) {
      mark.frame_id = id;
    } else if (mark.camera.empty() &&
               std::find(cameras.begin(), cameras.end(), word) != cameras.end()) {
      // A camera called 7 is not meant by every 7.
      const bool plain_number = number && word.size() < kFileDigits;
      if (!plain_number || bracketed.contains(i) ||
          (i > 0 &&
           (words[i - 1] == "camera" || words[i - 1] == "images" || words[i - 1] == "keypoints2d" ||
            words[i - 1] == "labels" || words[i - 1] == "masks"))) {
        mark.camera = word;
      }
    }
  }
  return mark;
}

}  // namespace atelier
