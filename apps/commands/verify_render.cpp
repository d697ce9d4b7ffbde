#include "apps/commands/verify_render.h"

#include <algorithm>
#include <ctime>
#include <iostream>
#include <optional>

#include "capture/video_file.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/file_kind.h"
#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/limits.h"
#include "core/mark/image_mark.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/saturating_cast.h"
#include "pipeline/sealing/judged_credentials.h"
#include "pipeline/sealing/video_limit.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr int kVideoFrames = 12;  // of which the mean is looked through

enum class Kind { Other, Image, Video };

Kind kind_of(const std::string& file) {
  if (file_kind(file) != fs::file_type::regular) {
    return Kind::Other;
  }
  const std::vector<std::byte> start = read_file_start(file, 12, std::int64_t{1} << 40).bytes;
  const std::string_view text(reinterpret_cast<const char*>(start.data()), start.size());
  if (text.starts_with("\x89PNG") || text.starts_with("\xFF\xD8\xFF")) {
    return Kind::Image;
  }
  return text.size() == 12 && text.substr(4, 4) == "ftyp" ? Kind::Video : Kind::Other;
}

/// Mean brightness of frames all over a video: what moves blurs, the mark stays.
ImageOf<float> video_brightness(const std::string& file, std::string& what) {
  VideoFile video(file);
  const int count = std::min(kVideoFrames, video.frames());
  ImageOf<float> mean(video.width(), video.height(), 1);
  for (int i = 0; i < count; ++i) {
    const int index = saturating_cast<int>((i + 0.5) * video.frames() / count);
    const ImageOf<float> one = mark_brightness(video.frame(index));
    std::transform(one.data.begin(), one.data.end(), mean.data.begin(), mean.data.begin(),
                   [&](float value, float sum) { return sum + value / static_cast<float>(count); });
  }
  what = "MP4, " + counted(video.frames(), "frame") + " of " + std::to_string(video.width()) +
         " x " + std::to_string(video.height());
  return mean;
}

ImageOf<float> image_brightness(const std::string& file, const std::string& bytes,
                                std::string& what) {
  const auto span = std::as_bytes(std::span(bytes));
  const ImageHeader header = read_image_header(span, file);
  what = std::string(format_name(header.format)) + ", " + std::to_string(header.width) + " x " +
         std::to_string(header.height);
  return mark_brightness(read_byte_image(span, file));
}

/// Who has consented to what, by id, and what that says to the use, in one line. True where it is
/// covered.
bool show_consent(const std::vector<Consent>& consent, const ConsentUse& use) {
  const ConsentAnswer answer = ask_consent(consent, use, static_cast<double>(std::time(nullptr)));
  std::string text = consent.empty() ? "none recorded" : "";
  for (const Consent& one : consent) {
    text += (text.empty() ? "" : "; ") + consent_id(one) + " " + to_string({one});
  }
  text += "; " + use.purpose +
          (!answer.refusals.empty() ? " refused"
           : consent.empty()        ? ": nobody has consented"
           : answer.doubts.empty()  ? " covered"
                                    : " not refused");
  for (const std::string& reason : answer.refusals.empty() ? answer.doubts : answer.refusals) {
    text += "; " + reason;
  }
  std::cout << "consent: " << printable(text) << "\n";
  return answer.refusals.empty() && !consent.empty();
}

}  // namespace

bool is_image_or_video(const std::string& file) {
  try {
    return kind_of(file) != Kind::Other;
  } catch (const DataError&) {
    return false;
  }
}

int verify_render(const std::string& file, const ConsentUse& use) {
  const bool video = kind_of(file) == Kind::Video;
  const std::string bytes =
      read_file_text(file, video ? kMaxVideoBytes : Limits{}.image_file_bytes);
  const JudgedCredentials judged = judge_credentials(bytes, file);
  std::string what;
  const std::optional<FoundMark> mark =
      find_mark(video ? video_brightness(file, what) : image_brightness(file, bytes, what)).found;
  const auto statement = judged.found ? judged.found->statement : std::nullopt;
  std::cout << printable(file) << ": " << what << "; "
            << printable(origin_text(judged, mark.has_value())) << "\n";
  bool covered = false;
  if (statement) {
    covered = show_consent(statement->consent, use);
  } else {
    std::cout << "consent: not said\n";
  }
  std::cout << "made of: " << (statement ? printable(made_of_text(*statement)) : "not said") << "\n"
            << "signature: "
            << (!judged.found            ? "none"
                : judged.problem.empty() ? "valid, by " + signature_key_text(*judged.found->signer)
                                         : "does not hold: " + printable(judged.problem))
            << "\nmark: " << mark_line(mark, statement) << "\n";
  const bool other_mark = mark && statement && mark_of(*statement) != mark->bits;
  return judged.found && judged.problem.empty() && covered && !other_mark ? kExitDone
                                                                          : kExitCheckFailed;
}

}  // namespace atelier
