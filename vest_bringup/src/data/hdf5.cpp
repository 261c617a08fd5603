#include "vest_bringup/data/hdf5.h"

#include <hdf5.h>

#include <functional>
#include <stdexcept>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace vest::data {
namespace {

/// What HDF5 handed out.
class Id {
 public:
  Id(hid_t id, herr_t (*close)(hid_t), const std::string& what) : id_(id), close_(close) {
    if (id < 0) throw std::runtime_error(what + ": HDF5 cannot write it (is the disk full?)");
  }
  ~Id() { close_(id_); }
  Id(const Id&) = delete;
  Id& operator=(const Id&) = delete;
  operator hid_t() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

void must(herr_t code, const std::string& what) {
  if (code < 0) throw std::runtime_error(what + ": HDF5 cannot write it (is the disk full?)");
}

Id group(hid_t in, const std::string& name) {
  return {H5Gcreate2(in, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose, name};
}

void attribute(hid_t of, const char* name, std::int64_t value) {
  const Id space(H5Screate(H5S_SCALAR), H5Sclose, name);
  const Id a(H5Acreate2(of, name, H5T_STD_I64LE, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose, name);
  must(H5Awrite(a, H5T_NATIVE_INT64, &value), name);
}

void attribute(hid_t of, const char* name, const std::string& text) {
  const Id space(H5Screate(H5S_SCALAR), H5Sclose, name);
  const Id type(H5Tcopy(H5T_C_S1), H5Tclose, name);
  must(H5Tset_size(type, H5T_VARIABLE), name), must(H5Tset_cset(type, H5T_CSET_UTF8), name);
  const Id a(H5Acreate2(of, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose, name);
  const char* const begin = text.c_str();
  must(H5Awrite(a, type, &begin), name);
}

/// @param stored type in the file  @param given type of the numbers
void dataset(hid_t in, const std::string& name, hid_t stored, hid_t given, const std::vector<hsize_t>& shape,
             const void* numbers) {
  const Id space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose, name);
  const Id d(H5Dcreate2(in, name.c_str(), stored, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Dclose,
             name);
  if (numbers) must(H5Dwrite(d, given, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers), name);
}

void floats(hid_t in, const std::string& name, const std::vector<hsize_t>& shape,
            const std::vector<float>& numbers) {
  dataset(in, name, H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, shape, numbers.data());
}

/// uint8 N x height x width x 3, red green blue, a chunk per picture.
void pictures(hid_t in, const std::string& name, const std::string* files, std::size_t count) {
  cv::Mat picture = cv::imread(files[0], cv::IMREAD_COLOR);
  const hsize_t shape[] = {count, static_cast<hsize_t>(picture.rows), static_cast<hsize_t>(picture.cols), 3};
  const hsize_t one[] = {1, shape[1], shape[2], 3};
  const Id space(H5Screate_simple(4, shape, nullptr), H5Sclose, name);
  const Id memory(H5Screate_simple(4, one, nullptr), H5Sclose, name);
  const Id how(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, name);
  must(H5Pset_chunk(how, 4, one), name), must(H5Pset_deflate(how, 4), name);
  const Id d(H5Dcreate2(in, name.c_str(), H5T_STD_U8LE, space, H5P_DEFAULT, how, H5P_DEFAULT), H5Dclose,
             name);
  for (hsize_t k = 0; k < count; ++k) {
    picture = cv::imread(files[k], cv::IMREAD_COLOR);
    if (picture.rows != static_cast<int>(shape[1]) || picture.cols != static_cast<int>(shape[2]))
      throw std::runtime_error(files[k] + ": cannot be read");
    cv::cvtColor(picture, picture, cv::COLOR_BGR2RGB);
    const hsize_t begin[] = {k, 0, 0, 0};
    must(H5Sselect_hyperslab(space, H5S_SELECT_SET, begin, nullptr, one, nullptr), name);
    must(H5Dwrite(d, H5T_NATIVE_UINT8, memory, space, H5P_DEFAULT, picture.data), name);
  }
}

void mask(hid_t in, const char* name, const std::vector<std::string>& names) {
  std::size_t size = 1;
  std::string joined;
  for (const auto& n : names) size = std::max(size, n.size());
  for (auto n : names) n.resize(size), joined += n;
  const Id type(H5Tcopy(H5T_C_S1), H5Tclose, name);
  must(H5Tset_size(type, size), name), must(H5Tset_strpad(type, H5T_STR_NULLPAD), name);
  dataset(in, name, type, type, {names.size()}, joined.data());
}

class Writer {
 public:
  Writer(const std::vector<Episode>& episodes, const std::vector<std::string>& files)
      : episodes_(episodes), files_(files), hands_(handsInAll(episodes)), seen_(seenInAll(episodes)) {}

  void demo(hid_t data, const Episode& e) {
    checkSamples(e);
    const std::size_t n = e.rows.size() - 1;
    const Id demo = group(data, e.name);
    attribute(demo, "num_samples", static_cast<std::int64_t>(n));
    attribute(demo, "scene", e.scene), attribute(demo, "scene_hash", e.scene_hash);
    std::vector<float> actions(n * hands_.size() * kActionSize), rewards(n);
    std::vector<std::int64_t> dones(n);
    for (std::size_t k = 0; k < n; ++k) {
      beyond_ += actionsAt(e, k, hands_, &actions[k * hands_.size() * kActionSize]) ? 1 : 0;
      rewards[k] = static_cast<float>(e.rows[k + 1].score - e.rows[k].score);
      dones[k] = k + 1 == n ? 1 : 0;
    }
    samples_ += n;
    floats(demo, "actions", {n, hands_.size() * kActionSize}, actions);
    floats(demo, "rewards", {n}, rewards);
    dataset(demo, "dones", H5T_STD_I64LE, H5T_NATIVE_INT64, {n}, dones.data());
    dataset(demo, "states", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, {n, 0}, nullptr);
    observations(group(demo, "obs"), e, 0, n);
    observations(group(demo, "next_obs"), e, 1, n);
  }

  std::string environment() const {
    std::vector<std::string> hands;
    for (const std::size_t h : hands_) hands.emplace_back(kInstruments[h]);
    const Episode& first = episodes_.front();
    return nlohmann::json{
        {"env_name", "vest/" + first.scene},
        {"type", 2},  // robomimic's EnvType.GYM_TYPE
        {"env_kwargs", {{"hands", hands}, {"rate_hz", first.rate}, {"scene_hash", first.scene_hash}}}}
        .dump();
  }

  std::size_t samples() const { return samples_; }
  std::size_t beyond() const { return beyond_; }

 private:
  void observations(const Id& in, const Episode& e, std::size_t from, std::size_t n) const {
    std::vector<double> row;
    std::vector<float> numbers(n);
    for (std::size_t k = 0; k < n; ++k) numbers[k] = static_cast<float>(e.rows[from + k].time);
    floats(in, "time", {n, 1}, numbers);
    for (const std::size_t i : seen_) {
      std::size_t at = 0;
      for (const Column& c : columnsOf(i)) {
        numbers.clear();
        for (std::size_t k = 0; k < n; ++k) {
          values(e.rows[from + k].tools[i], i, row);
          for (std::size_t v = 0; v < c.width; ++v) numbers.push_back(static_cast<float>(row[at + v]));
        }
        floats(in, std::string(kInstruments[i]) + "_" + c.name, {n, c.width}, numbers);
        at += c.width;
      }
    }
    if (!files_.empty()) pictures(in, "endoscope_image", &files_[e.first_picture + from], n);
  }

  const std::vector<Episode>& episodes_;
  const std::vector<std::string>& files_;
  std::vector<std::size_t> hands_, seen_;
  std::size_t samples_ = 0, beyond_ = 0;
};

}  // namespace

std::size_t writeHdf5(const std::string& file, const std::vector<Episode>& episodes,
                      const std::vector<std::string>& files) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // its pages of errors: ours say it in a sentence
  Writer writer(episodes, files);
  const Id to(H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose, file);
  const Id data = group(to, "data");
  std::vector<std::string> train, valid;
  for (const Episode& e : episodes) {
    writer.demo(data, e);
    (e.valid ? valid : train).push_back(e.name);
  }
  attribute(data, "total", static_cast<std::int64_t>(writer.samples()));
  attribute(data, "env_args", writer.environment());
  const Id masks = group(to, "mask");
  mask(masks, "train", train), mask(masks, "valid", valid);
  must(H5Fflush(to, H5F_SCOPE_GLOBAL), file);
  return writer.beyond();
}

}  // namespace vest::data
