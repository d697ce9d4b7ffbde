#include "bodymodel/formats/gltf_people.h"

#include <algorithm>
#include <utility>

#include "core/io/text_scanner.h"
#include "core/nearest_name.h"
#include "core/unknown_value.h"

namespace atelier {
namespace {

// 1 'Ada', 2 'Ben', ...
std::string listed_skins(const GltfScene& scene, const std::vector<std::size_t>& skins) {
  constexpr std::size_t kNamed = 20;
  std::string listed;
  for (std::size_t i = 0; i < std::min(skins.size(), kNamed); ++i) {
    listed += (i > 0 ? ", " : "") + std::to_string(skins[i] + 1) + " '" +
              scene.skins[skins[i]].name.substr(0, 40) + "'";
  }
  return listed + (skins.size() > kNamed ? ", ..." : "");
}

// Skins in the order in which meshes wear them, then those that none wears.
std::vector<std::size_t> worn_first(const GltfScene& scene) {
  std::vector<std::size_t> order;
  std::vector<char> there(scene.skins.size(), 0);
  const auto add = [&](std::size_t skin) {
    if (std::exchange(there[skin], 1) == 0) {
      order.push_back(skin);
    }
  };
  for (const GltfNode& node : scene.nodes) {
    if (node.mesh >= 0 && node.skin >= 0) {
      add(static_cast<std::size_t>(node.skin));
    }
  }
  for (std::size_t skin = 0; skin < scene.skins.size(); ++skin) {
    add(skin);
  }
  return order;
}

std::size_t first_of_person(std::vector<std::size_t>& person, std::size_t skin) {
  while (person[skin] != skin) {
    person[skin] = person[person[skin]];
    skin = person[skin];
  }
  return skin;
}

// Whose skin each is: a skin of the same person, the same for all of that person's.
std::vector<std::size_t> people_of_skins(const GltfScene& scene) {
  constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  std::vector<std::size_t> person(scene.skins.size());
  std::vector<std::size_t> of_node(scene.nodes.size(), kNone);
  for (std::size_t skin = 0; skin < person.size(); ++skin) {
    person[skin] = skin;
    for (const int joint : scene.skins[skin].joints) {
      std::size_t& there = of_node[static_cast<std::size_t>(joint)];
      if (there == kNone) {
        there = skin;
      }
      person[first_of_person(person, skin)] = first_of_person(person, there);
    }
  }
  for (std::size_t skin = 0; skin < person.size(); ++skin) {
    for (const int joint : scene.skins[skin].joints) {
      // To the next joint above, whose own walk goes on from there.
      int node = scene.nodes[static_cast<std::size_t>(joint)].parent;
      while (node >= 0 && of_node[static_cast<std::size_t>(node)] == kNone) {
        node = scene.nodes[static_cast<std::size_t>(node)].parent;
      }
      if (node >= 0) {
        person[first_of_person(person, skin)] =
            first_of_person(person, of_node[static_cast<std::size_t>(node)]);
      }
    }
  }
  for (std::size_t skin = 0; skin < person.size(); ++skin) {
    person[skin] = first_of_person(person, skin);
  }
  return person;
}

bool is_channel_of_joints(const GltfChannel& channel) {
  return channel.node >= 0 && !channel.times.empty() &&
         (channel.path == GltfPath::Rotation || channel.path == GltfPath::Translation);
}

bool changes(const GltfChannel& channel) {
  constexpr double kStill = 1e-6;  // of a rotation's quaternion, or the scene's unit
  return (channel.values.rowwise() - channel.values.row(0)).cwiseAbs().maxCoeff() > kStill;
}

// The people whose joints an animation moves, or for whom it has keys at all.
std::vector<char> people_moved(const GltfScene& scene, const GltfAnimation& animation,
                               const std::vector<std::size_t>& person, bool truly) {
  std::vector<char> keyed(scene.nodes.size(), 0);
  for (const GltfChannel& channel : animation.channels) {
    if (is_channel_of_joints(channel) && (!truly || changes(channel))) {
      keyed[static_cast<std::size_t>(channel.node)] = 1;
    }
  }
  std::vector<char> moved(person.size(), 0);
  for (std::size_t skin = 0; skin < person.size(); ++skin) {
    for (const int joint : scene.skins[skin].joints) {
      moved[person[skin]] |= keyed[static_cast<std::size_t>(joint)];
    }
  }
  return moved;
}

}  // namespace

std::size_t named_skin(const GltfScene& scene, const std::string& wanted, const std::string& file) {
  std::vector<std::string> names;
  std::vector<std::size_t> all;
  for (const GltfSkin& skin : scene.skins) {
    all.push_back(names.size());
    names.push_back(skin.name);
  }
  const auto found = std::find(names.begin(), names.end(), wanted);
  if (found != names.end()) {
    return static_cast<std::size_t>(found - names.begin());
  }
  std::int64_t number = 0;
  if (parse_integer(wanted, number) && number >= 1 && std::cmp_less_equal(number, names.size())) {
    return static_cast<std::size_t>(number) - 1;
  }
  throw UnknownValue(file, "skin", wanted, listed_skins(scene, all) + did_you_mean(wanted, names));
}

bool moves_joint_of(const GltfScene& scene, const GltfAnimation& animation, std::size_t skin) {
  std::vector<char> joint(scene.nodes.size(), 0);
  for (const int node : scene.skins[skin].joints) {
    joint[static_cast<std::size_t>(node)] = 1;
  }
  return std::any_of(animation.channels.begin(), animation.channels.end(), [&](const auto& one) {
    return is_channel_of_joints(one) && joint[static_cast<std::size_t>(one.node)] != 0;
  });
}

std::size_t moving_skin(const GltfScene& scene, const GltfAnimation& animation,
                        const std::string& wanted, const std::string& file,
                        std::vector<Finding>& findings) {
  if (!wanted.empty()) {
    return named_skin(scene, wanted, file);
  }
  const std::vector<std::size_t> order = worn_first(scene);
  if (order.size() == 1) {
    return order[0];
  }
  const std::vector<std::size_t> person = people_of_skins(scene);
  std::vector<char> moved = people_moved(scene, animation, person, true);
  if (std::count(moved.begin(), moved.end(), 1) == 0) {
    moved = people_moved(scene, animation, person, false);
  }
  std::vector<std::size_t> people;  // the largest skin of each
  for (const std::size_t skin : order) {
    if (moved[person[skin]] == 0) {
      continue;
    }
    const auto same = std::find_if(people.begin(), people.end(), [&](std::size_t other) {
      return person[other] == person[skin];
    });
    if (same == people.end()) {
      people.push_back(skin);
    } else if (scene.skins[skin].joints.size() > scene.skins[*same].joints.size()) {
      *same = skin;
    }
  }
  if (people.empty()) {
    return order[0];
  }
  if (people.size() > 1) {
    findings.push_back({Severity::Warning, "motion-skins", file,
                        "the animation moves " + std::to_string(people.size()) +
                            " skeletons, of the skins " + listed_skins(scene, people),
                        std::to_string(people[0] + 1) +
                            " is taken; --motion.skin NAME or NUMBER of body-model takes another"});
  }
  return people[0];
}

}  // namespace atelier
