#include "pipeline/sealing/signed_render.h"

#include <algorithm>
#include <cmath>

#include "core/atomic_file.h"
#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/saturating_cast.h"
#include "pipeline/sealing/credentials_file.h"
#include "pipeline/sealing/film_limit.h"

namespace atelier {

SignedRender::SignedRender(RenderStatement statement, SigningKey key)
    : statement_(std::move(statement)), key_(std::move(key)), mark_(mark_of(statement_)) {}

Image SignedRender::marked(const Image& frame) const {
  ByteImage bytes = srgb_from_linear(frame);
  mark_.add_to(bytes);
  return linear_from_srgb(bytes);
}

void SignedRender::write_png(const std::filesystem::path& path, const Image& image) const {
  ByteImage bytes = srgb_from_linear(image);
  for (std::size_t i = 3; image.channels == 4 && i < bytes.data.size(); i += 4) {
    bytes.data[i] = saturating_cast<std::uint8_t>(
        std::round(255.0F * std::clamp(image.data[i], 0.0F, 1.0F)));  // alpha is linear in files
  }
  mark_.add_to(bytes);
  write_file_atomically(
      path, png_with_credentials(image_bytes(bytes, ImageFormat::Png), statement_, key_));
}

void SignedRender::sign_film(const std::filesystem::path& film) const {
  std::string bytes = read_file_text(film, kMostFilmBytes);
  bytes += mp4_credentials(bytes, statement_, key_);
  write_file_atomically(film, bytes);
}

}  // namespace atelier
