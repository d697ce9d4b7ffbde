#include "simulation/projective/body_contacts.h"

#include "core/parallel.h"

namespace atelier {
namespace {

constexpr Index kContactGrain = 256;

}  // namespace

BodyContacts::BodyContacts(const Triangles& faces, const CommonSolverOptions& options,
                           const Material& material, int substeps)
    : body_(faces), substeps_(substeps), rules_(bound_rules(options, material, substeps)) {}

void BodyContacts::begin_frame(const Control& control, double time_step,
                               const std::vector<Vec4<double>>& x,
                               const std::vector<Vec4<double>>& velocity,
                               const std::vector<Vec4<double>>& acceleration) {
  contacts_.clear();
  found_.resize(x.size());
  velocity_.resize(x.size());
  acceleration_.resize(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    velocity_[i] = xyz(velocity[i]);
    acceleration_[i] = xyz(acceleration[i]);
  }
  body_.begin_frame(control, time_step, rules_.wide, {x, velocity_, acceleration_});
}

const std::vector<TouchedBody>& BodyContacts::find(int s, double h, std::vector<Vec4<double>>& x,
                                                   const std::vector<Vec4<double>>& flight) {
  contacts_.clear();
  if (empty()) {
    return contacts_;
  }
  const BodySubstep<double> step = substep(s, rules_.wide);
  parallel_for(static_cast<Index>(x.size()), kContactGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      found_[i].particle = -1;
      if (!(x[i].w > 0)) {
        continue;
      }
      const Passage<double> way{xyz(x[i]), xyz(x[i]) + h * xyz(flight[i]), step.t0, step.t1};
      const FreeFlight<double> free = body_.free_flight(i);
      const BodySearch search = body_search(outlook()[i], way.p1, free, step.t1);
      if (search == BodySearch::Nothing) {
        continue;
      }
      const auto of_candidates = [&](const Passage<double>& w) {
        return body_.choose(i, w, rules_.wide.reach, true);
      };
      const FaceChoice<double> choice = choose_on_way(body_.body(), outlook()[i], way, search,
                                                      rules_.wide, of_candidates, AloneInTree{});
      const VelocityBound bound = bound_of_choice(body_.body(), choice, way, rules_, h, x[i]);
      if (bound.holds != 0) {
        found_[i] = {static_cast<int>(i), bound};
      } else if (search == BodySearch::Candidates) {
        look_out_again(body_.outlook()[i], choice.nearest, way.p1, free, step.t1, rules_.wide);
      }
    }
  });
  for (const TouchedBody& contact : found_) {
    if (contact.particle >= 0) {
      contacts_.push_back(contact);
    }
  }
  return contacts_;
}

std::vector<TouchedBody> BodyContacts::find_across(int s, double h,
                                                   const std::vector<TouchedBody>& known,
                                                   const std::vector<Vec4<double>>& x,
                                                   const std::vector<Vec4<double>>& v) const {
  const BodySubstep<double> step = substep(s, rules_.wide);
  std::vector<TouchedBody> found(known.size());
  parallel_for(std::ssize(known), kContactGrain, [&](Index begin, Index end) {
    for (Index k = begin; k < end; ++k) {
      found[k].particle = -1;
      const int i = known[k].particle;
      Vec4<double> start = x[i];
      const Passage<double> way{xyz(start), xyz(start) + h * xyz(v[i]), step.t0, step.t1};
      if (!is_looked_at_again(way, rules_)) {
        continue;
      }
      const FaceChoice<double> choice =
          choose_on_way(body_.body(), outlook()[i], way, BodySearch::Tree, rules_.wide,
                        NoCandidates{}, AloneInTree{});
      const VelocityBound bound = bound_of_choice(body_.body(), choice, way, rules_, h, start);
      if (lies_across(bound, known[k].bound, xyz(v[i]))) {
        found[k] = {i, bound};
      }
    }
  });
  std::erase_if(found, [](const TouchedBody& one) { return one.particle < 0; });
  return found;
}

bool BodyContacts::keep_out(int s, int particle, BodyParticle<double>& p) {
  BodyOutlook<double> outlook = body_.outlook()[particle];  // renewed for a wider distance alone
  return body_.touch(particle, p, substep(s, rules_.guard), outlook);
}

bool BodyContacts::meet(int s, int particle, BodyParticle<double>& p, const Vec4<double>& origin,
                        Meeting meeting) {
  return meeting == Meeting::Touches
             ? p.x.w > 0 && keep_out(s, particle, p)
             : stay_with_body(p, origin, substep(s, rules_.kept), outlook()[particle], meeting);
}

}  // namespace atelier
