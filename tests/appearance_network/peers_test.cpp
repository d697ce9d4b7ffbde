#include "appearance/network/peers.h"

#include <future>
#include <map>
#include <mutex>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/appearance_network/appearance_fixture.h"
#include "tests/appearance_network/peers_fixture.h"

namespace atelier {
namespace {

using fixtures::largest_difference;
using fixtures::small_data;
using fixtures::train_together;
using ::testing::HasSubstr;

TrainOptions tiny_options(int iterations, int batch) {
  TrainOptions options;
  options.resolution = 16;
  options.channels = 2;
  options.iterations = iterations;
  options.batch = batch;
  options.learning_rate = 1e-3;
  return options;
}

/// Views with different numbers of pixels: each pixel counts alike, whoever has it.
AppearanceData uneven_data() {
  AppearanceData data = small_data();
  for (std::size_t i = 0; i < data.views.size(); i += 2) {
    AppearanceView& view = data.views[i];
    const std::size_t kept = view.pixel.size() / (2 + i);
    view.pixel.resize(kept);
    view.u.resize(kept);
    view.v.resize(kept);
    view.colors.resize(3 * kept);
  }
  return data;
}

TEST(Peers, TwoProcesses_GiveTheWeightsOfOneWithTwiceTheBatch) {
  const AppearanceData data = uneven_data();
  const TrainOptions halves = tiny_options(24, 2);
  const TrainOptions whole = tiny_options(12, 4);
  const TrainResult one = train(start_training(data, whole), data, whole, Device::Cpu);
  const auto two = train_together(start_training(data, halves), data, halves, {{}, {}});
  EXPECT_EQ(two[0].training.iteration, 24);
  EXPECT_EQ(two[0].training.updates, 12);
  EXPECT_LT(largest_difference(one.training.model, two[0].training.model), 1e-5);
  EXPECT_EQ(largest_difference(two[0].training.model, two[1].training.model), 0);
  EXPECT_GT(largest_difference(one.training.model, start_training(data, whole).model), 1e-3);
}

TEST(Peers, EveryStep_IsToldOnceByTheFirstProcess) {
  const AppearanceData data = small_data();
  const TrainOptions options = tiny_options(8, 1);
  std::vector<double> alone;
  TrainHooks each;
  each.step = [&](std::int64_t, const NetworkLoss& loss, double) { alone.push_back(loss.value); };
  train(start_training(data, options), data, options, Device::Cpu, each);
  std::vector<std::int64_t> steps;
  std::vector<double> losses;
  TrainHooks first;
  first.step = [&](std::int64_t step, const NetworkLoss& loss, double) {
    steps.push_back(step);
    losses.push_back(loss.value);
  };
  TrainHooks other;
  other.step = [](std::int64_t, const NetworkLoss&, double) { ADD_FAILURE(); };
  train_together(start_training(data, options), data, options, {first, other, other});
  EXPECT_THAT(steps, ::testing::ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));  // the ninth is none
  EXPECT_NEAR(losses[0], alone[0], 1e-6) << "before any update";
}

TEST(Peers, CheckpointOfTwo_GoesOnWithAnyNumber) {
  const AppearanceData data = small_data();
  const TrainOptions options = tiny_options(24, 1);
  std::int64_t seen = 0;
  TrainHooks first;
  first.step = [&](std::int64_t step, const NetworkLoss&, double) { seen = step; };
  first.stop = [&] { return seen >= 12; };
  const auto half = train_together(start_training(data, options), data, options, {first, {}});
  EXPECT_TRUE(half[0].stopped && half[1].stopped) << "one says it for all";
  const Training read =
      training_of(tensors_of(half[0].training), texts_of(half[0].training), "checkpoint");
  EXPECT_EQ(read.iteration, 12);
  EXPECT_EQ(read.updates, 6);
  require_same_training(read, data, options);
  const TrainResult whole =
      train_together(start_training(data, options), data, options, {{}, {}})[0];
  const TrainResult two = train_together(read, data, options, {{}, {}})[0];
  EXPECT_EQ(largest_difference(whole.training.model, two.training.model), 0);
  for (const std::size_t count : {1U, 3U}) {
    const TrainResult other =
        train_together(read, data, options, std::vector<TrainHooks>(count))[0];
    EXPECT_EQ(other.training.iteration, 24);
    EXPECT_LT(largest_difference(whole.training.model, other.training.model), 0.02) << count;
  }
}

TEST(Peers, ProcessThatEndsByItself_EndsTheOthersInSilence) {
  const TemporaryFolder folder;
  const std::string rendezvous = (folder.path / "rendezvous").string();
  std::thread other([&] {
    const Peers peers({1, 2, 1, rendezvous}, Device::Cpu, [](const std::string&) {});
  });
  std::promise<std::string> said;
  std::once_flag once;
  Peers peers({0, 2, 0, rendezvous}, Device::Cpu, [&](const std::string& message) {
    std::call_once(once, [&] { said.set_value(message); });
  });
  other.join();
  EXPECT_EQ(said.get_future().get(), "");
}

EnvironmentVariables environment_of(const std::map<std::string, std::string>& variables) {
  return [variables](const std::string& name) {
    const auto found = variables.find(name);
    return found == variables.end() ? "" : found->second;
  };
}

std::string refusal(const std::function<PeerPlace()>& place) {
  try {
    place();
  } catch (const EnvironmentError& error) {
    return error.what();
  }
  return "none";
}

TEST(PeerPlace, TorchrunsVariables_AreUnderstood) {
  std::map<std::string, std::string> set = {{"RANK", "5"},
                                            {"WORLD_SIZE", "8"},
                                            {"LOCAL_RANK", "1"},
                                            {"MASTER_ADDR", "gpu03"},
                                            {"MASTER_PORT", "29500"}};
  const PeerPlace place = torchrun_place(environment_of(set));
  EXPECT_EQ(place.rank, 5);
  EXPECT_EQ(place.size, 8);
  EXPECT_EQ(place.local_rank, 1);
  EXPECT_EQ(place.rendezvous, "tcp://gpu03:29500");
  for (const auto& [name, value] :
       std::vector<std::pair<std::string, std::string>>{{"RANK", "8"},
                                                        {"RANK", "-1"},
                                                        {"WORLD_SIZE", "0"},
                                                        {"WORLD_SIZE", "two"},
                                                        {"LOCAL_RANK", "6"},
                                                        {"MASTER_ADDR", ""},
                                                        {"MASTER_PORT", "70000"},
                                                        {"MASTER_PORT", ""}}) {
    auto wrong = set;
    wrong[name] = value;
    EXPECT_THAT(refusal([&] { return torchrun_place(environment_of(wrong)); }), HasSubstr(name))
        << value;
  }
}

TEST(PeerPlace, SlurmsVariables_AreUnderstood) {
  std::map<std::string, std::string> set = {{"SLURM_PROCID", "3"},
                                            {"SLURM_NTASKS", "4"},
                                            {"SLURM_LOCALID", "1"},
                                            {"SLURM_STEP_NODELIST", "gpu[03-04]"},
                                            {"SLURM_JOB_ID", "1234567"}};
  const PeerPlace place = slurm_place(environment_of(set));
  EXPECT_EQ(place.rank, 3);
  EXPECT_EQ(place.size, 4);
  EXPECT_EQ(place.local_rank, 1);
  EXPECT_EQ(place.rendezvous, "tcp://gpu03:30567");
  set["MASTER_ADDR"] = "10.0.0.1";
  set["MASTER_PORT"] = "4000";
  EXPECT_EQ(slurm_place(environment_of(set)).rendezvous, "tcp://10.0.0.1:4000");
  set.erase("SLURM_PROCID");
  EXPECT_THAT(refusal([&] { return slurm_place(environment_of(set)); }),
              HasSubstr("SLURM_PROCID: not set"));
}

TEST(PeerPlace, FirstHost_IsTheFirstOfAList) {
  EXPECT_EQ(first_host("node1"), "node1");
  EXPECT_EQ(first_host("login,gpu[01-04]"), "login");
  EXPECT_EQ(first_host("gpu[07,09-12]"), "gpu07");
  EXPECT_EQ(first_host("gpu[003-010].cluster,login"), "gpu003.cluster");
  EXPECT_THROW(first_host("gpu[01"), EnvironmentError);
}

}  // namespace
}  // namespace atelier
