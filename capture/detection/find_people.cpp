#include "capture/detection/find_people.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "capture/detection/loaded_network.h"
#include "capture/detection/person_detector.h"
#include "core/error.h"
#include "core/io/byte_reader.h"
#include "core/io/file_bytes.h"
#include "core/io/worker.h"
#include "core/parallel.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kMaxNetworkBytes = 200'000'000;  // the largest is 55 MB
constexpr double kSameCrop = 0.5;                       ///< share of two crops in common
constexpr double kSamePoints = 0.05;  ///< of a crop's side, mean distance of two people's points

PersonLandmarks landmarks_of(LoadedNetwork& network, const ByteImage& image, const PersonCrop& crop,
                             const std::string& file) {
  return decode_landmarks(network.run(sampled_crop(image, crop, kLandmarkInput, 0, 1)), crop, file);
}

/// Both networks; lives in the confined process.
class PeopleFinder {
 public:
  PeopleFinder(const PeopleNetworks& networks, const FindPeopleOptions& options)
      : options_(options),
        networks_(networks),
        landmarks_(networks.landmarks, networks.landmarks_file) {}

  PeopleInImage look(const ByteImage& image, const std::vector<PersonCrop>& expected) {
    PeopleInImage people;
    for (const PersonCrop& crop : expected) {
      add(image, crop, people);
    }
    if (people.size() < static_cast<std::size_t>(options_.people)) {
      if (!person_) {
        person_.emplace(networks_.person, networks_.person_file);
      }
      const auto outputs = person_->run(
          sampled_crop(image, image_crop(image.width, image.height), kPersonInput, -1, 1));
      for (const DetectedPerson& seen : decode_people(
               outputs, image.width, image.height, options_.min_detection, networks_.person_file)) {
        const bool followed = std::any_of(
            people.begin(), people.end(),
            [&](const PersonLandmarks& one) { return overlap(one.next, seen.crop) > kSameCrop; });
        if (!followed && people.size() < static_cast<std::size_t>(options_.people)) {
          add(image, seen.crop, people);
        }
      }
    }
    return people;
  }

 private:
  /// The person of the crop, unless nobody is there or who is there already is.
  void add(const ByteImage& image, const PersonCrop& crop, PeopleInImage& people) {
    if (!(crop.side > 1) || !std::isfinite(crop.side)) {
      return;
    }
    PersonLandmarks one = landmarks_of(landmarks_, image, crop, networks_.landmarks_file);
    const bool again = std::any_of(people.begin(), people.end(), [&](const PersonLandmarks& other) {
      const double apart =
          (one.points.leftCols<2>() - other.points.leftCols<2>()).rowwise().norm().mean();
      return apart < kSamePoints * crop.side;
    });
    if (one.presence >= options_.min_presence && !again) {
      people.push_back(std::move(one));
    }
  }

  FindPeopleOptions options_;
  const PeopleNetworks& networks_;
  std::optional<LoadedNetwork> person_;  // read when it is first needed
  LoadedNetwork landmarks_;
};

void append_crop(std::vector<std::byte>& bytes, const PersonCrop& crop) {
  for (const double value : {crop.center.x(), crop.center.y(), crop.side, crop.turn}) {
    append_value(bytes, value);
  }
}

void append_landmarks(std::vector<std::byte>& bytes, const PersonLandmarks& one) {
  append_value(bytes, one.presence);
  append_crop(bytes, one.next);
  append_crop(bytes, one.crop);
  append_values(bytes, std::span(one.points.data(), static_cast<std::size_t>(one.points.size())));
  append_values(bytes, std::span(one.mask.data.data(), one.mask.data.size()));
}

double finite_value(ByteReader& reader) {
  const auto value = reader.little<double>("value");
  if (!std::isfinite(value)) {
    reader.fail("a number that is not finite", "finite ones; the networks may be damaged");
  }
  return value;
}

PersonCrop read_crop(ByteReader& reader) {
  PersonCrop crop;
  for (double* value : {&crop.center.x(), &crop.center.y(), &crop.side, &crop.turn}) {
    *value = finite_value(reader);
  }
  return crop;
}

PersonLandmarks read_landmarks(ByteReader& reader) {
  PersonLandmarks one;
  one.presence = finite_value(reader);
  one.next = read_crop(reader);
  one.crop = read_crop(reader);
  one.points = DetectedPoints::Zero(kLandmarks, 3);
  for (Eigen::Index i = 0; i < one.points.size(); ++i) {
    one.points.data()[i] = finite_value(reader);
  }
  one.mask = ByteImage(kLandmarkInput, kLandmarkInput, 1);
  const auto pixels = reader.take(one.mask.data.size(), "mask");
  std::transform(pixels.begin(), pixels.end(), one.mask.data.begin(),
                 [](std::byte value) { return static_cast<std::uint8_t>(value); });
  return one;
}

void append_sequence(std::vector<std::byte>& bytes, PeopleFinder& finder,
                     const ImageSequence& sequence) {
  std::vector<PersonCrop> crops = sequence.expected;
  for (const ByteImage& image : sequence.images) {
    const PeopleInImage people = finder.look(image, crops);
    append_value(bytes, static_cast<std::uint32_t>(people.size()));
    crops.clear();
    for (const PersonLandmarks& one : people) {
      append_landmarks(bytes, one);
      crops.push_back(one.next);
    }
  }
}

PeopleInImage read_people(ByteReader& reader) {
  PeopleInImage people;
  const std::size_t count =
      reader.paid(reader.little<std::uint32_t>("people"), sizeof(double), "people");
  for (std::size_t p = 0; p < count; ++p) {
    people.push_back(read_landmarks(reader));
  }
  return people;
}

/// The confined process does not say which of the two is at fault.
std::string files_of(const PeopleNetworks& networks) {
  return networks.person_file + ", " + networks.landmarks_file;
}

const char* landmark_file_name(LandmarkNetwork network) {
  switch (network) {
    case LandmarkNetwork::Lite:
      return "landmarks_lite.onnx";
    case LandmarkNetwork::Full:
      return "landmarks_full.onnx";
    case LandmarkNetwork::Heavy:
      break;
  }
  return "landmarks_heavy.onnx";
}

}  // namespace

OptionTable describe(FindPeopleOptions& options) {
  OptionTable table;
  table.add("network", options.network,
            {{"lite", LandmarkNetwork::Lite},
             {"full", LandmarkNetwork::Full},
             {"heavy", LandmarkNetwork::Heavy}},
            "Landmark network of the built-in detector: lite is faster, heavy more accurate");
  table.add("people", options.people, 1, 20, "",
            "Maximum number of people found in an image by the built-in detector");
  table.add("min_detection", options.min_detection, 0.05, 1, "",
            "Minimum score of a person found in a whole image by the built-in detector");
  table.add("min_presence", options.min_presence, 0, 1, "",
            "Minimum probability that a person is in a crop, below which the built-in detector "
            "takes the person for lost");
  return table;
}

std::string default_network_folder() {
  const char* data = std::getenv("XDG_DATA_HOME");
  const char* home = std::getenv("HOME");
  if (data != nullptr && *data == '/') {  // a relative one is to be ignored, says its definition
    return (fs::path(data) / "atelier" / "networks").string();
  }
  return home != nullptr && *home != '\0'
             ? (fs::path(home) / ".local" / "share" / "atelier" / "networks").string()
             : "";
}

PeopleNetworks read_people_networks(const std::string& folder, LandmarkNetwork network) {
  PeopleNetworks networks;
  networks.person_file = (fs::path(folder) / "person.onnx").string();
  networks.landmarks_file = (fs::path(folder) / landmark_file_name(network)).string();
  for (const std::string& file : {networks.person_file, networks.landmarks_file}) {
    std::error_code error;
    if (!fs::exists(file, error)) {
      throw EnvironmentError(
          file,
          "the built-in detector's network is not there: scripts/detector-networks of "
          "Atelier's sources fetches it from npm; or give --model with a network of yours");
    }
  }
  networks.person = read_file_bytes(networks.person_file, kMaxNetworkBytes);
  networks.landmarks = read_file_bytes(networks.landmarks_file, kMaxNetworkBytes);
  return networks;
}

std::vector<std::vector<PeopleInImage>> find_people(const PeopleNetworks& networks,
                                                    const std::vector<ImageSequence>& sequences,
                                                    const FindPeopleOptions& options,
                                                    const Limits& limits) {
  for (const ImageSequence& sequence : sequences) {
    for (const ByteImage& image : sequence.images) {
      ATELIER_CHECK((image.channels == 1 || image.channels == 3) && !image.data.empty(),
                    "an image of 1 or 3 channels");
    }
  }
  std::vector<std::vector<PeopleInImage>> all(sequences.size());
  const auto count = static_cast<Index>(sequences.size());
  const Index share = (count + thread_count() - 1) / std::max(thread_count(), 1);
  parallel_for(count, std::max<Index>(share, 1), [&](Index begin, Index end) {
    const std::vector<std::byte> bytes = run_in_worker(
        [&] {
          quieten_opencv();
          PeopleFinder finder(networks, options);
          std::vector<std::byte> reply;
          for (Index s = begin; s < end; ++s) {
            append_sequence(reply, finder, sequences[static_cast<std::size_t>(s)]);
          }
          return reply;
        },
        files_of(networks), limits);
    ByteReader reader(bytes, networks.landmarks_file);
    for (auto s = static_cast<std::size_t>(begin); s < static_cast<std::size_t>(end); ++s) {
      for (std::size_t i = 0; i < sequences[s].images.size(); ++i) {
        all[s].push_back(read_people(reader));
      }
    }
  });
  return all;
}

std::vector<PersonLandmarks> landmarks_of_crops(const PeopleNetworks& networks,
                                                const std::vector<CropOfImage>& crops,
                                                const Limits& limits) {
  std::vector<PersonLandmarks> all(crops.size());
  const auto count = static_cast<Index>(crops.size());
  const Index share = (count + thread_count() - 1) / std::max(thread_count(), 1);
  parallel_for(count, std::max<Index>(share, 1), [&](Index begin, Index end) {
    const auto first = static_cast<std::size_t>(begin);
    const auto last = static_cast<std::size_t>(end);
    const std::vector<std::byte> bytes = run_in_worker(
        [&] {
          quieten_opencv();
          LoadedNetwork network(networks.landmarks, networks.landmarks_file);
          std::vector<std::byte> reply;
          for (std::size_t i = first; i < last; ++i) {
            append_landmarks(reply, landmarks_of(network, *crops[i].image, crops[i].crop,
                                                 networks.landmarks_file));
          }
          return reply;
        },
        files_of(networks), limits);
    ByteReader reader(bytes, networks.landmarks_file);
    for (std::size_t i = first; i < last; ++i) {
      all[i] = read_landmarks(reader);
    }
  });
  return all;
}

}  // namespace atelier
