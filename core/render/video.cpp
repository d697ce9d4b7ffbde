#include "core/render/video.h"

#include <memory>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/late_library.h"
#include "core/render/late/film.h"

namespace atelier {

void write_video(const std::filesystem::path& path, Index count,
                 const std::function<Image(Index frame_idx)>& frame, const VideoOptions& options) {
  ATELIER_CHECK(count > 0, "a video needs at least one frame");
  ATELIER_CHECK(options.fps >= 0.1 && options.fps <= 1000, "fps must lie in [0.1, 1000]");
  ATELIER_CHECK(options.quality >= 0 && options.quality <= 51, "quality must lie in [0, 51]");
  Image first = frame(0);
  ATELIER_CHECK(first.channels == 3 && first.width > 0 && first.height > 0,
                "a video needs frames of 3 channels");
  AtomicFile file(path);
  static const auto new_film =
      late_function<decltype(atelier_new_film)>("libatelier_film.so", "atelier_new_film");
  const std::unique_ptr<Film> film(new_film(path, file.temporary_path(), (first.width + 1) / 2 * 2,
                                            (first.height + 1) / 2 * 2, options));
  film->add(srgb_from_linear(first), 0);
  for (Index i = 1; i < count; ++i) {
    const Image next = frame(i);
    ATELIER_CHECK(next.width == first.width && next.height == first.height && next.channels == 3,
                  "a video needs frames of one size");
    film->add(srgb_from_linear(next), i);
  }
  film->finish();
  file.commit();
}

}  // namespace atelier
