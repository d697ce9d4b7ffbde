#include "simulation/projective/contact_impulses.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "core/parallel.h"
#include "simulation/projective/coulomb.h"
#include "simulation/projective/velocity_bound_math.h"

namespace atelier {
namespace {

constexpr Index kImpulseGrain = 512;
constexpr int kSweeps = 2;       ///< of an iteration over contacts of cloth, up the levels and down
constexpr int kMostLevels = 64;  ///< more are solved as one
constexpr int kMostColours = 64;  ///< of a level; what is left is solved one after the other

Vec3d relative_velocity(const TouchedCloth& touch, const std::vector<Vec4<double>>& v) {
  return relative_velocity(touch, [&](int i) { return xyz(v[i]); });
}

/// Levels of contacts: 0 where a particle is on the body or held, one more on each layer above;
/// kMostLevels where nothing below ends there.
std::vector<int> contact_levels(const std::vector<TouchedCloth>& cloth,
                                const std::vector<TouchedBody>& body,
                                const std::vector<double>& inverse_mass) {
  std::vector<int> height(inverse_mass.size(), kMostLevels);  // of particles
  for (std::size_t i = 0; i < inverse_mass.size(); ++i) {
    height[i] = inverse_mass[i] > 0 ? kMostLevels : 0;
  }
  for (const TouchedBody& contact : body) {
    height[contact.particle] = 0;
  }
  std::vector<int> level(cloth.size(), kMostLevels);
  for (int at = 0; at < kMostLevels; ++at) {
    bool any = false;
    for (std::size_t c = 0; c < cloth.size(); ++c) {
      const int* const p = cloth[c].particle;
      const int least = std::min({height[p[0]], height[p[1]], height[p[2]], height[p[3]]});
      if (level[c] == kMostLevels && least == at) {
        level[c] = at;
        any = true;
        for (int k = 0; k < 4; ++k) {
          height[p[k]] = std::min(height[p[k]], at + 1);
        }
      }
    }
    if (!any) {
      break;
    }
  }
  return level;
}

ContactImpulses::Residual residual_of(const std::vector<double>& contacts, double weight) {
  ContactImpulses::Residual out;
  double sum = 0;
  for (const double one : contacts) {
    sum += one * one;
    out.most = std::max(out.most, one / weight);
  }
  if (!contacts.empty()) {
    out.root_mean_square = std::sqrt(sum / static_cast<double>(contacts.size())) / weight;
  }
  return out;
}

}  // namespace

void ContactImpulses::begin_step(const std::vector<TouchedBody>& body,
                                 const std::vector<TouchedCloth>& cloth, const Frictions& friction,
                                 const std::vector<double>& inverse_mass) {
  friction_ = friction;
  inverse_mass_ = inverse_mass;
  body_.clear();
  across_.clear();
  for (const TouchedBody& contact : body) {
    const bool gentle = !gentle_.empty() && gentle_[contact.particle] != 0;
    body_.push_back({contact, 1 / inverse_mass[contact.particle], {}, gentle});
  }
  sort_into_batches(cloth);
}

void ContactImpulses::sort_into_batches(const std::vector<TouchedCloth>& cloth) {
  std::vector<TouchedBody> on_body;
  for (const BodyImpulse& one : body_) {
    on_body.push_back(one.contact);
  }
  const std::vector<int> level = contact_levels(cloth, on_body, inverse_mass_);
  // Batches by level and colour; `taken` are the colours around each particle in its level.
  constexpr int kColumns = kMostColours + 1;
  std::vector<std::vector<int>> batches(static_cast<std::size_t>(kMostLevels + 1) * kColumns);
  std::vector<std::uint64_t> taken(inverse_mass_.size());
  std::vector<int> taken_in(inverse_mass_.size(), -1);
  std::vector<int> by_level(cloth.size());
  for (std::size_t c = 0; c < cloth.size(); ++c) {
    by_level[c] = static_cast<int>(c);
  }
  std::stable_sort(by_level.begin(), by_level.end(),
                   [&](int a, int b) { return level[a] < level[b]; });
  for (int c : by_level) {
    std::uint64_t around = 0;
    for (int p : cloth[c].particle) {
      around |= taken_in[p] == level[c] ? taken[p] : 0;
    }
    const int colour = std::countr_one(around);
    for (int p : cloth[c].particle) {
      taken[p] = (taken_in[p] == level[c] ? taken[p] : 0) |
                 (colour < kMostColours ? std::uint64_t{1} << colour : 0);
      taken_in[p] = level[c];
    }
    batches[static_cast<std::size_t>(level[c]) * kColumns + colour].push_back(c);
  }
  cloth_.clear();
  batch_begin_ = {0};
  shares_.clear();
  for (std::size_t b = 0; b < batches.size(); ++b) {
    for (int c : batches[b]) {
      double weight = 0;
      for (int k = 0; k < 4; ++k) {
        weight += cloth[c].weight[k] * cloth[c].weight[k] * inverse_mass_[cloth[c].particle[k]];
      }
      if (weight > 0) {
        cloth_.push_back({cloth[c], 1 / weight});
      }
    }
    if (static_cast<int>(cloth_.size()) > batch_begin_.back()) {
      batch_begin_.push_back(static_cast<int>(cloth_.size()));
      shares_.push_back(b % kColumns == kMostColours ? 1 : 0);
    }
  }
}

int ContactImpulses::add_across(const std::vector<TouchedBody>& body) {
  std::vector<char> has(inverse_mass_.size(), 0);
  for (const BodyImpulse& c : across_) {
    has[c.contact.particle] = 1;
  }
  int added = 0;
  for (const TouchedBody& contact : body) {
    if (has[contact.particle] == 0) {
      const bool gentle = !gentle_.empty() && gentle_[contact.particle] != 0;
      across_.push_back({contact, 1 / inverse_mass_[contact.particle], {}, gentle});
      ++added;
    }
  }
  return added;
}

/// Impulses of gentle contacts, which stay so in the iteration.
void ContactImpulses::begin_gently(const std::vector<Vec4<double>>& now) {
  for (std::vector<BodyImpulse>* contacts : {&body_, &across_}) {
    for (BodyImpulse& c : *contacts) {
      if (c.gentle) {
        const Vec3d v = xyz(now[c.contact.particle]);
        c.impulse = bound_impulse(c.contact.bound, c.impulse, c.mass, v, friction_.body);
      }
    }
  }
}

/// In `contacts` a particle comes once.
void ContactImpulses::hold_each(std::vector<BodyImpulse>& contacts,
                                std::vector<Vec4<double>>& velocity) const {
  parallel_for(std::ssize(contacts), kImpulseGrain, [&](Index begin, Index end) {
    for (Index k = begin; k < end; ++k) {
      BodyImpulse& c = contacts[k];
      if (c.gentle) {
        continue;
      }
      Vec4<double>& v = velocity[c.contact.particle];
      const Vec3d next = bound_impulse(c.contact.bound, c.impulse, c.mass, xyz(v), friction_.body);
      v = with_w(xyz(v) + (1 / c.mass) * (next - c.impulse), v.w);
      c.impulse = next;
    }
  });
}

void ContactImpulses::hold_body(std::vector<Vec4<double>>& velocity) {
  hold_each(body_, velocity);
  for (int turn = 0; turn < kBodyTurns && !across_.empty(); ++turn) {
    hold_each(across_, velocity);
    hold_each(body_, velocity);
  }
}

void ContactImpulses::hold_batch(std::size_t batch, std::vector<Vec4<double>>& velocity) {
  const Index first = batch_begin_[batch];
  const Index count = batch_begin_[batch + 1] - first;
  parallel_for(count, shares_[batch] != 0 ? count : kImpulseGrain, [&](Index begin, Index end) {
    for (Index k = first + begin; k < first + end; ++k) {
      ClothImpulse& c = cloth_[k];
      const Vec3d next = touch_impulse(c.contact, c.impulse, c.mass,
                                       relative_velocity(c.contact, velocity), friction_.cloth);
      const Vec3d change = next - c.impulse;
      c.impulse = next;
      for (int i = 0; i < 4; ++i) {
        const int particle = c.contact.particle[i];
        Vec4<double>& v = velocity[particle];
        v = with_w(xyz(v) + (c.contact.weight[i] * inverse_mass_[particle]) * change, v.w);
      }
    }
  });
}

void ContactImpulses::hold(std::vector<Vec4<double>>& velocity,
                           const std::vector<Vec4<double>>& now) {
  begin_gently(now);
  // Where the last iteration left off.
  for (const std::vector<BodyImpulse>* contacts : {&body_, &across_}) {
    for (const BodyImpulse& c : *contacts) {
      Vec4<double>& v = velocity[c.contact.particle];
      v = with_w(xyz(v) + (1 / c.mass) * c.impulse, v.w);
    }
  }
  for (const ClothImpulse& c : cloth_) {
    for (int i = 0; i < 4; ++i) {
      const int particle = c.contact.particle[i];
      Vec4<double>& v = velocity[particle];
      v = with_w(xyz(v) + (c.contact.weight[i] * inverse_mass_[particle]) * c.impulse, v.w);
    }
  }
  hold_body(velocity);
  const std::size_t batches = shares_.size();
  for (int sweep = 0; sweep < kSweeps && batches > 0; ++sweep) {
    for (std::size_t b = 0; b < batches; ++b) {
      hold_batch(b, velocity);
    }
    for (std::size_t b = batches; b-- > 0;) {
      hold_batch(b, velocity);
    }
    hold_body(velocity);
  }
}

ContactImpulses::Residual ContactImpulses::body_residual(const std::vector<Vec4<double>>& implied,
                                                         const std::vector<Vec4<double>>& v,
                                                         double weight) const {
  // Of a particle with two contacts each has what the other leaves.
  std::vector<Vec3d> known(v.size(), Vec3d{});
  for (const std::vector<BodyImpulse>* contacts : {&body_, &across_}) {
    for (const BodyImpulse& c : *contacts) {
      known[c.contact.particle] += c.impulse;
    }
  }
  std::vector<double> residuals;
  for (const std::vector<BodyImpulse>* contacts : {&body_, &across_}) {
    for (const BodyImpulse& c : *contacts) {
      const int particle = c.contact.particle;
      const VelocityBound& bound = c.contact.bound;
      const Vec3d beyond = -lacking_velocity(bound, xyz(v[particle]));
      const Vec3d own = xyz(implied[particle]) - (known[particle] - c.impulse);
      residuals.push_back(coulomb_residual(own, beyond, bound.normal, friction_.body, c.mass));
    }
  }
  return residual_of(residuals, weight);
}

ContactImpulses::Residual ContactImpulses::cloth_residual(const std::vector<Vec4<double>>& v,
                                                          double weight) const {
  std::vector<double> residuals;
  for (const ClothImpulse& c : cloth_) {
    const Vec3d beyond =
        -lacking_velocity(relative_velocity(c.contact, v), c.contact.normal, c.contact.least);
    residuals.push_back(
        coulomb_residual(c.impulse, beyond, c.contact.normal, friction_.cloth, c.mass));
  }
  return residual_of(residuals, weight);
}

}  // namespace atelier
