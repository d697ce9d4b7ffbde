#include "capture/frame_reader.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "capture/camera_conventions.h"
#include "capture/camera_readings.h"
#include "capture/keypoint_schema.h"
#include "capture/keypoints3d_file.h"
#include "capture/label_taxonomy.h"
#include "capture/video_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/foreign_hdf5.h"
#include "core/io/lower_extension.h"
#include "core/io/text_scanner.h"
#include "core/io/zip_archive.h"

namespace atelier {
namespace {

std::string name_of(const DataLocation& place) {
  return place.member.empty() ? place.file.string() : place.file.string() + ": " + place.member;
}

bool is_video(const DataLocation& place) {
  return place.member.empty() && place.index >= 0;
}

bool is_zip(const DataLocation& place) {
  return !place.member.empty() && lower_extension(place.file) == ".zip";
}

bool is_hdf5(const DataLocation& place) {
  return !place.member.empty() && !is_zip(place);
}

const char* extension_of(ImageFormat format) {
  switch (format) {
    case ImageFormat::Png:
      return ".png";
    case ImageFormat::Jpeg:
      return ".jpg";
    case ImageFormat::Tiff:
      return ".tif";
    case ImageFormat::WebP:
      return ".webp";
    case ImageFormat::Bmp:
      return ".bmp";
    case ImageFormat::Avif:
      return ".avif";
  }
  return ".png";
}

PersonKeypoints as_meant(PersonKeypoints person, const Dataset& dataset, std::size_t camera) {
  const KeypointReading& reading = dataset.frames[camera].reading;
  if (reading != KeypointReading{}) {
    // While the order is still guessed there is none; sides say nothing of it.
    const std::string& order = dataset.info.keypoint_schema;
    person.points =
        read_as(person.points, reading, order.empty() ? body_25_schema() : keypoint_schema(order),
                dataset.cameras[camera].width, dataset.cameras[camera].height);
  }
  return person;
}

/// 255 where a mask's pixel says person: palettes by index, images by their brightest channel,
/// alpha where there is one; soft mattes at one half; 0/1 masks as they are.
ByteImage binary_mask(std::span<const std::byte> bytes, const std::string& name,
                      const Limits& limits) {
  const ImageHeader header = read_image_header(bytes, name, limits);
  constexpr std::uint8_t kOn = 255;
  constexpr std::uint8_t kHalf = 128;
  if (header.palette) {
    ByteImage mask = read_labels(bytes, name, limits);
    for (std::uint8_t& value : mask.data) {
      value = value == 0 ? 0 : kOn;
    }
    return mask;
  }
  const ByteImage picture = read_byte_image(bytes, name, true, limits);
  ByteImage mask(picture.width, picture.height, 1);
  const auto channels = static_cast<std::size_t>(picture.channels);
  bool alpha = false;  // some masks are RGBA with an alpha that says nothing
  for (std::size_t i = 3; channels == 4 && i < picture.data.size(); i += 4) {
    alpha = alpha || picture.data[i] != kOn;
  }
  std::uint8_t brightest = 0;
  for (std::size_t i = 0; i < mask.data.size(); ++i) {
    const std::uint8_t* pixel = picture.data.data() + i * channels;
    mask.data[i] =
        alpha ? pixel[3] : *std::max_element(pixel, pixel + std::min<std::size_t>(channels, 3));
    brightest = std::max(brightest, mask.data[i]);
  }
  const std::uint8_t least = brightest <= 1 ? 1 : kHalf;
  for (std::uint8_t& value : mask.data) {
    value = value >= least ? kOn : 0;
  }
  return mask;
}

/// A mask or label image at the size of the camera's images, where it is an exact scale of them (to
/// a pixel): each pixel is that of the file in which its centre lies. Else as it is.
ByteImage at_image_size(ByteImage read, const CameraFrames& frames) {
  const int width = frames.image_width;
  const int height = frames.image_height;
  if (width == 0 || (read.width == width && read.height == height) || read.width == 0 ||
      read.height == 0) {
    return read;
  }
  const double scale = static_cast<double>(read.width) / width;
  if (std::abs(read.height - scale * height) > std::max(1.0, scale)) {
    return read;
  }
  ByteImage scaled(width, height, 1);
  for (int y = 0; y < height; ++y) {
    const int from_y = static_cast<int>((2 * std::int64_t{y} + 1) * read.height / (2 * height));
    for (int x = 0; x < width; ++x) {
      const int from_x = static_cast<int>((2 * std::int64_t{x} + 1) * read.width / (2 * width));
      scaled.at(x, y) = read.at(from_x, from_y);
    }
  }
  return scaled;
}

}  // namespace

struct FrameReader::State {
  Dataset dataset;
  Limits limits;
  std::optional<ZipArchive> zip;  ///< the one read last
  std::optional<VideoFile> video;
  std::filesystem::path video_path;
  std::filesystem::path hdf5_path;  ///< of `hdf5`
  std::map<std::string, Tensor> hdf5;
  std::map<std::string, std::map<int, std::vector<PersonKeypoints>>> detections;

  std::size_t camera(Index camera_idx) const {
    ATELIER_CHECK(camera_idx >= 0 && camera_idx < static_cast<Index>(dataset.cameras.size()),
                  "a camera that the data set does not have");
    return static_cast<std::size_t>(camera_idx);
  }

  /// One dataset of an HDF5 file. Reading starts a process that reads the whole file, so that what
  /// the other cameras have of the same frame comes with it.
  const Tensor& hdf5_tensor(const DataLocation& place, FrameLocations CameraFrames::*kind,
                            int frame_id) {
    if (hdf5_path != place.file || !hdf5.contains(place.member)) {
      std::vector<std::string> names = {place.member};
      if (kind != nullptr) {
        for (const CameraFrames& frames : dataset.frames) {
          const std::optional<DataLocation> other = (frames.*kind).find(frame_id);
          if (other && other->file == place.file && other->member != place.member) {
            names.push_back(other->member);
          }
        }
      }
      hdf5 = read_foreign_hdf5(place.file, names, limits);
      hdf5_path = place.file;
    }
    return hdf5.at(place.member);
  }

  std::vector<std::byte> bytes(const DataLocation& place, FrameLocations CameraFrames::*kind,
                               int frame_id) {
    if (is_zip(place)) {
      if (!zip || zip->file() != place.file.string()) {
        zip.emplace(place.file, limits);
      }
      return zip->read(place.member, limits.image_file_bytes);
    }
    if (is_hdf5(place)) {
      const Tensor& tensor = hdf5_tensor(place, kind, frame_id);
      if (tensor.type != ElementType::UInt8) {
        throw DataError(place.file.string(), place.member, element_type_name(tensor.type),
                        "the bytes of an encoded image, uint8");
      }
      return tensor.data;
    }
    return read_file_bytes(place.file, limits.image_file_bytes);
  }

  VideoFile& opened(const DataLocation& place) {
    if (!video || video_path != place.file) {
      video.emplace(place.file, limits);
      video_path = place.file;
    }
    return *video;
  }
  ByteImage video_frame(const DataLocation& place) { return opened(place).frame(place.index); }

  /// Everybody in every frame of a file that holds many; files stay in memory, since frames of all
  /// cameras are read in turn.
  const std::map<int, std::vector<PersonKeypoints>>& detection_frames(const DataLocation& place) {
    const auto there = detections.find(place.file.string());
    if (there != detections.end()) {
      return there->second;
    }
    const std::vector<std::byte> bytes = read_file_bytes(place.file, limits.text_file_bytes);
    return detections
        .emplace(place.file.string(), parse_detection_frames(as_text(bytes), place.file.string(),
                                                             dataset.keypoint_shift, limits))
        .first->second;
  }

  /// Row `index` of an array [F,K,C] of numbers.
  RowMatrix row_of(const DataLocation& place, FrameLocations CameraFrames::*kind, int frame_id,
                   std::int64_t columns) {
    const Tensor& tensor = hdf5_tensor(place, kind, frame_id);
    const auto refuse = [&](const std::string& expected) {
      throw DataError(place.file.string(), place.member, "an array of " + shape_text(tensor.shape),
                      expected);
    };
    if (tensor.shape.size() != 3 || tensor.shape[2] < columns) {
      refuse("[frames, points, " + std::to_string(columns) + "]");
    }
    if (place.index < 0 || place.index >= tensor.shape[0]) {
      refuse("row " + std::to_string(place.index));
    }
    check_finite(tensor, place.file.string(), place.member);
    const std::vector<double> values = doubles_of(tensor, place.file.string(), place.member);
    const std::int64_t points = tensor.shape[1];
    RowMatrix row(points, columns);
    for (std::int64_t i = 0; i < points; ++i) {
      for (std::int64_t j = 0; j < columns; ++j) {
        row(i, j) =
            values[static_cast<std::size_t>((place.index * points + i) * tensor.shape[2] + j)];
      }
    }
    return row;
  }
};

FrameReader::FrameReader(Dataset dataset, const Limits& limits)
    : state_(std::make_unique<State>()) {
  ATELIER_CHECK(dataset.frames.size() == dataset.cameras.size(), "frames of other cameras");
  state_->dataset = std::move(dataset);
  state_->limits = limits;
}

FrameReader::~FrameReader() = default;
FrameReader::FrameReader(FrameReader&&) noexcept = default;
FrameReader& FrameReader::operator=(FrameReader&&) noexcept = default;

const Dataset& FrameReader::dataset() const {
  return state_->dataset;
}

std::optional<ImageHeader> FrameReader::image_header(Index camera_idx, int frame_id) {
  const std::optional<DataLocation> place =
      state_->dataset.frames[state_->camera(camera_idx)].images.find(frame_id);
  if (!place) {
    return std::nullopt;
  }
  if (is_video(*place)) {
    const VideoFile& video = state_->opened(*place);
    ImageHeader header;
    header.width = video.width();
    header.height = video.height();
    header.channels = 3;
    header.bit_depth = 8;
    return header;
  }
  return read_image_header(state_->bytes(*place, &CameraFrames::images, frame_id), name_of(*place),
                           state_->limits);
}

std::optional<ByteImage> FrameReader::byte_image(Index camera_idx, int frame_id) {
  const std::optional<DataLocation> place =
      state_->dataset.frames[state_->camera(camera_idx)].images.find(frame_id);
  if (!place) {
    return std::nullopt;
  }
  if (is_video(*place)) {
    return state_->video_frame(*place);
  }
  return read_byte_image(state_->bytes(*place, &CameraFrames::images, frame_id), name_of(*place),
                         false, state_->limits);
}

std::optional<Image> FrameReader::image(Index camera_idx, int frame_id) {
  const std::optional<DataLocation> place =
      state_->dataset.frames[state_->camera(camera_idx)].images.find(frame_id);
  if (!place) {
    return std::nullopt;
  }
  if (is_video(*place)) {
    return linear_from_srgb(state_->video_frame(*place));
  }
  return read_image(state_->bytes(*place, &CameraFrames::images, frame_id), name_of(*place), {},
                    state_->limits);
}

std::optional<ByteImage> FrameReader::mask(Index camera_idx, int frame_id) {
  const std::optional<DataLocation> place =
      state_->dataset.frames[state_->camera(camera_idx)].masks.find(frame_id);
  if (place) {
    ByteImage read = binary_mask(state_->bytes(*place, &CameraFrames::masks, frame_id),
                                 name_of(*place), state_->limits);
    if (state_->dataset.frames[state_->camera(camera_idx)].inverted_masks) {
      for (std::uint8_t& value : read.data) {
        value = static_cast<std::uint8_t>(255 - value);
      }
    }
    return at_image_size(std::move(read), state_->dataset.frames[state_->camera(camera_idx)]);
  }
  std::optional<ByteImage> mask = labels(camera_idx, frame_id);
  if (mask) {
    for (std::uint8_t& value : mask->data) {
      value = value == static_cast<std::uint8_t>(Label::Background) ? 0 : 255;
    }
  }
  return mask;
}

std::optional<ByteImage> FrameReader::labels(Index camera_idx, int frame_id) {
  const std::optional<DataLocation> place =
      state_->dataset.frames[state_->camera(camera_idx)].labels.find(frame_id);
  if (!place) {
    return std::nullopt;
  }
  const LabelTaxonomy& taxonomy = label_taxonomy(state_->dataset.info.label_taxonomy);
  const std::vector<std::byte> bytes = state_->bytes(*place, &CameraFrames::labels, frame_id);
  const std::string name = name_of(*place);
  const bool colors =
      !taxonomy.colors.empty() && read_image_header(bytes, name, state_->limits).channels >= 3;
  return at_image_size(
      to_atelier_labels(colors ? read_byte_image(bytes, name, false, state_->limits)
                               : read_labels(bytes, name, state_->limits),
                        taxonomy, name),
      state_->dataset.frames[state_->camera(camera_idx)]);
}

std::optional<ImageHeader> FrameReader::mask_header(Index camera_idx, int frame_id) {
  const CameraFrames& frames = state_->dataset.frames[state_->camera(camera_idx)];
  const std::optional<DataLocation> mask = frames.masks.find(frame_id);
  const std::optional<DataLocation> place = mask ? mask : frames.labels.find(frame_id);
  if (!place) {
    return std::nullopt;
  }
  return read_image_header(
      state_->bytes(*place, mask ? &CameraFrames::masks : &CameraFrames::labels, frame_id),
      name_of(*place), state_->limits);
}

std::vector<PersonKeypoints> FrameReader::keypoints(Index camera_idx, int frame_id) {
  const Dataset& dataset = state_->dataset;
  const std::optional<DataLocation> place =
      dataset.frames[state_->camera(camera_idx)].keypoints.find(frame_id);
  if (!place) {
    return {};
  }
  if (dataset.keypoint_file == KeypointFile::Rows) {
    PersonKeypoints person;
    person.points = state_->row_of(*place, &CameraFrames::keypoints, frame_id, 3);
    for (Index i = 0; i < person.points.rows(); ++i) {
      if (!person.points.row(i).isZero(0)) {
        person.points.block<1, 2>(i, 0).array() += dataset.keypoint_shift;
      }
    }
    return {as_meant(std::move(person), dataset, state_->camera(camera_idx))};
  }
  std::vector<PersonKeypoints> people;
  if (place->index >= 0) {  // of a file of many frames
    const auto& frames = state_->detection_frames(*place);
    const auto found = frames.find(place->index);
    people = found == frames.end() ? people : found->second;
  } else {
    const std::vector<std::byte> bytes = state_->bytes(*place, nullptr, frame_id);
    const std::string_view text = as_text(bytes);
    people = dataset.keypoint_file == KeypointFile::EasyMocap
                 ? parse_easymocap_annotation(text, name_of(*place), dataset.keypoint_shift,
                                              state_->limits)
                 : parse_detections(text, name_of(*place), dataset.keypoint_shift, state_->limits);
  }
  for (PersonKeypoints& person : people) {
    person = as_meant(std::move(person), dataset, state_->camera(camera_idx));
  }
  return people;
}

std::vector<PersonPoints> FrameReader::keypoints3d(int frame_id) {
  const Dataset& dataset = state_->dataset;
  const std::optional<DataLocation> place = dataset.keypoints3d.find(frame_id);
  if (!place) {
    return {};
  }
  std::vector<PersonPoints> people;
  if (is_hdf5(*place)) {
    PersonPoints person;
    person.points = state_->row_of(*place, nullptr, frame_id, 4);
    people.push_back(std::move(person));
  } else {
    const std::vector<std::byte> bytes = state_->bytes(*place, nullptr, frame_id);
    people = parse_keypoints3d(as_text(bytes), name_of(*place), state_->limits);
  }
  const Eigen::Matrix3d turn =
      dataset.world_convention.metres_per_unit * y_up_from(dataset.world_convention.up);
  for (PersonPoints& person : people) {
    person.points.leftCols<3>() = (person.points.leftCols<3>() * turn.transpose()).eval();
  }
  return people;
}

std::optional<EncodedImage> FrameReader::encoded_image(Index camera_idx, int frame_id) {
  const std::optional<DataLocation> place =
      state_->dataset.frames[state_->camera(camera_idx)].images.find(frame_id);
  if (!place) {
    return std::nullopt;
  }
  if (is_video(*place)) {
    const std::string png = image_bytes(state_->video_frame(*place), ImageFormat::Png);
    const auto raw = std::as_bytes(std::span(png));
    return EncodedImage{{raw.begin(), raw.end()}, ".png"};
  }
  EncodedImage image;
  image.bytes = state_->bytes(*place, &CameraFrames::images, frame_id);
  image.extension =
      extension_of(read_image_header(image.bytes, name_of(*place), state_->limits).format);
  return image;
}

}  // namespace atelier
