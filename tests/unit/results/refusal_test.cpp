#include <cmath>
#include <deque>
#include <fstream>
#include <functional>
#include <limits>

#include "files.h"
#include "repose/base/hdf5.h"
#include "repose/results/model_file.h"

// A valid file with one thing spoiled must be refused by the name of that thing.
namespace repose::results {
namespace refusal_test {

using base::check_hdf5;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Changes single things of a file.
class Spoiler {
 public:
  explicit Spoiler(const std::filesystem::path& file)
      : file_(H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT)) {}

  void remove(const std::string& path) const {
    check_hdf5(H5Ldelete(file_, path.c_str(), H5P_DEFAULT));
  }
  template <class Value>
  void set(const std::string& path, hsize_t entry, Value value) const {
    const base::Hdf5Dataset dataset(H5Dopen2(file_, path.c_str(), H5P_DEFAULT));
    const base::Hdf5Space space(H5Dget_space(dataset));
    std::vector<Value> values(check_hdf5(H5Sget_simple_extent_npoints(space)));
    check_hdf5(H5Dread(dataset, memory<Value>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()));
    values.at(entry) = value;
    check_hdf5(H5Dwrite(dataset, memory<Value>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()));
  }
  /// Replaces a dataset by one of another type or shape with the values given, or none.
  void replace(const std::string& path, hid_t type, const std::vector<hsize_t>& shape,
               hid_t memory_type = -1, const void* values = nullptr) const {
    remove(path);
    const base::Hdf5Space space(
        H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr));
    const base::Hdf5Dataset dataset(
        H5Dcreate2(file_, path.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
    if (values) check_hdf5(H5Dwrite(dataset, memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values));
  }
  /// Stores the same values as another type.
  void convert(const std::string& path, hid_t type) const {
    const base::Hdf5Dataset old(H5Dopen2(file_, path.c_str(), H5P_DEFAULT));
    const base::Hdf5Space space(H5Dget_space(old));
    std::vector<char> values(16 * check_hdf5(H5Sget_simple_extent_npoints(space)));
    check_hdf5(H5Dread(old, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()));
    remove(path);
    const base::Hdf5Dataset dataset(
        H5Dcreate2(file_, path.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
    check_hdf5(H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()));
  }
  void make_group(const std::string& path) const {
    const base::Hdf5Group made = base::create_hdf5_group(file_, path.c_str());
  }
  void remove_attribute(const std::string& object, const char* name) const {
    check_hdf5(H5Adelete_by_name(file_, object.c_str(), name, H5P_DEFAULT));
  }
  void set_attribute(const std::string& object, const char* name, hid_t type, hsize_t count,
                     const void* value) const {
    remove_attribute(object, name);
    const base::Hdf5Object place(H5Oopen(file_, object.c_str(), H5P_DEFAULT));
    const base::Hdf5Space space(H5Screate_simple(1, &count, nullptr));
    const base::Hdf5Attribute attribute(
        H5Acreate2(place, name, type, space, H5P_DEFAULT, H5P_DEFAULT));
    check_hdf5(H5Awrite(attribute, type, value));
  }

 private:
  template <class Value>
  static hid_t memory() {
    if constexpr (std::is_same_v<Value, double>) return H5T_NATIVE_DOUBLE;
    if constexpr (std::is_same_v<Value, int64_t>) return H5T_NATIVE_INT64;
  }
  base::Hdf5File file_;
};

struct Defect {
  const char* name;  ///< of the test
  std::function<void(const Spoiler&)> spoil;
  const char* message;  ///< a part of the refusal
};

std::ostream& operator<<(std::ostream& out, const Defect& defect) { return out << defect.name; }

std::string name_of(const ::testing::TestParamInfo<Defect>& info) { return info.param.name; }

// Single changes, as Defect::spoil.

template <class Value>
auto set(const char* path, hsize_t entry, Value value) {
  return [=](const Spoiler& f) { f.set<Value>(path, entry, value); };
}

auto remove(const char* path) {
  return [=](const Spoiler& f) { f.remove(path); };
}

auto remove_attribute(const char* object, const char* name) {
  return [=](const Spoiler& f) { f.remove_attribute(object, name); };
}

class ModelDefect : public ::testing::TestWithParam<Defect> {};

TEST_P(ModelDefect, IsRefusedByName) {
#ifdef __SANITIZE_ADDRESS__
  if (GetParam().name == std::string("TooLargeForTheMemory"))
    GTEST_SKIP() << "the address sanitizer ends a process that asks for too much memory";
#endif
  const Folder folder;
  write_small_result(folder.path("a"), small_model());
  ASSERT_EQ(refusal([&] { read_model(folder.path("a.h5")); }), "accepted");
  GetParam().spoil(Spoiler(folder.path("a.h5")));
  const std::string text = refusal([&] { read_model(folder.path("a.h5")); });
  EXPECT_EQ(text.rfind(folder.path("a.h5").string() + ": ", 0), 0u) << text;
  EXPECT_NE(text.find(GetParam().message), std::string::npos) << text;
}

const int64_t two = 2;
const double three_numbers[3] = {0, nan, 0};

std::vector<Defect> header_defects() {
  return {
      Defect{"NoFormat", remove_attribute("/", "format"), "/ attribute format: is missing"},
      Defect{"OtherFormat",
             [](const Spoiler& f) { f.set_attribute("/", "format", H5T_C_S1, 1, "x"); },
             "/ attribute format: is \"x\", expected \"tissue-model\""},
      Defect{"FormatIsANumber",
             [](const Spoiler& f) { f.set_attribute("/", "format", H5T_NATIVE_INT64, 1, &two); },
             "/ attribute format: holds 8-byte integers, expected strings"},
      Defect{"OtherVersion",
             [](const Spoiler& f) { f.set_attribute("/", "version", H5T_NATIVE_INT64, 1, &two); },
             "/ attribute version: is 2, this program reads version 1"},
      Defect{"NoModel", remove("/model"), "/model: is missing"},
      Defect{"NoGravity", remove_attribute("/model", "gravity"),
             "/model attribute gravity: is missing"},
      Defect{"GravityOfTwo",
             [](const Spoiler& f) {
               f.set_attribute("/model", "gravity", H5T_NATIVE_DOUBLE, 2, three_numbers);
             },
             "/model attribute gravity: has 2 values, expected 3"},
      Defect{"GravityNotFinite",
             [](const Spoiler& f) {
               f.set_attribute("/model", "gravity", H5T_NATIVE_DOUBLE, 3, three_numbers);
             },
             "/model attribute gravity: row 0 holds nan"}};
}

INSTANTIATE_TEST_SUITE_P(Header, ModelDefect, ::testing::ValuesIn(header_defects()), name_of);

std::vector<Defect> missing_defects() {
  std::vector<Defect> defects;
  for (const char* path :
       {"/model/point/position", "/model/point/set", "/model/point/target", "/model/point/layer",
        "/model/point/column", "/model/point/bone", "/model/spring/points", "/model/spring/set",
        "/model/spring/rest_length", "/model/spring/stiffness", "/model/spring/exponent",
        "/model/spring/reference", "/model/prism/points", "/model/prism/rest_volume",
        "/model/spring_set", "/model/bone_surface/1/points", "/model/bone_surface/0/triangles"})
    defects.push_back({path, remove(path), path});
  return defects;
}

INSTANTIATE_TEST_SUITE_P(Missing, ModelDefect, ::testing::ValuesIn(missing_defects()));

std::vector<Defect> shape_defects() {
  return {
      Defect{"GroupForDataset",
             [](const Spoiler& f) {
               f.remove("/model/point/mass");
               f.make_group("/model/point/mass");
             },
             "/model/point/mass: is a group or a type, expected a dataset"},
      Defect{"DatasetForGroup",
             [](const Spoiler& f) { f.replace("/model/point", H5T_NATIVE_INT, {3}); },
             "/model/point/position: is missing"},
      Defect{"TwoColumns",
             [](const Spoiler& f) {
               f.replace("/model/point/position", H5T_NATIVE_DOUBLE, {12, 2});
             },
             "/model/point/position: has shape [12,2], expected [rows,3]"},
      Defect{"OneDimension",
             [](const Spoiler& f) { f.replace("/model/point/position", H5T_NATIVE_DOUBLE, {36}); },
             "/model/point/position: has shape [36], expected [rows,3]"},
      Defect{"FewerRows",
             [](const Spoiler& f) { f.replace("/model/point/layer", H5T_NATIVE_INT, {11}); },
             "/model/point/layer: has shape [11], expected [12]"},
      Defect{"ScalarDataset",
             [](const Spoiler& f) { f.replace("/model/point/position", H5T_NATIVE_DOUBLE, {}); },
             "/model/point/position: has shape []"},
      Defect{"NoPointAtAll",
             [](const Spoiler& f) {
               f.replace("/model/point/position", H5T_NATIVE_DOUBLE, {0, 3});
               f.replace("/model/point/target", H5T_NATIVE_DOUBLE, {0, 3});
               f.replace("/model/point/external_force", H5T_NATIVE_DOUBLE, {0, 3});
               for (const char* path : {"set", "layer", "column", "bone", "mass"})
                 f.replace(std::string("/model/point/") + path, H5T_NATIVE_INT8, {0});
             },
             "/model/point/position: has no row"},
      Defect{"TooLargeForTheMemory",
             [](const Spoiler& f) {
               f.replace("/model/point/position", H5T_NATIVE_DOUBLE, {hsize_t{1} << 50, 3});
             },
             "/model/point/position: is larger than the memory"},
      Defect{"TransformsOfAnotherShape",
             [](const Spoiler& f) {
               f.replace("/model/bone_transform", H5T_NATIVE_DOUBLE, {2, 3, 4});
             },
             "/model/bone_transform: has shape [2,3,4], expected [2,4,4]"}};
}

INSTANTIATE_TEST_SUITE_P(Shape, ModelDefect, ::testing::ValuesIn(shape_defects()), name_of);

const uint64_t too_large[12] = {uint64_t{1} << 63};
const int32_t far_layer[12] = {-1};
const long double precise[12] = {1};

std::vector<Defect> type_defects() {
  return {Defect{"FloatsForIndices",
                 [](const Spoiler& f) { f.convert("/model/spring/points", H5T_NATIVE_DOUBLE); },
                 "/model/spring/points: holds 8-byte floating-point numbers, expected integers"},
          Defect{"FloatsForSets",
                 [](const Spoiler& f) { f.convert("/model/point/set", H5T_NATIVE_FLOAT); },
                 "/model/point/set: holds 4-byte floating-point numbers, expected integers"},
          Defect{"QuadruplePrecision",
                 [](const Spoiler& f) {
                   f.replace("/model/point/mass", H5T_NATIVE_LDOUBLE, {12}, H5T_NATIVE_LDOUBLE,
                             precise);
                 },
                 "/model/point/mass: holds 16-byte floating-point numbers"},
          Defect{"StringsForNumbers",
                 [](const Spoiler& f) { f.replace("/model/point/mass", H5T_C_S1, {12}); },
                 "/model/point/mass: holds strings, expected numbers"},
          Defect{"NumbersForNames",
                 [](const Spoiler& f) { f.replace("/model/spring_set", H5T_NATIVE_INT, {7}); },
                 "/model/spring_set: holds 4-byte integers, expected strings"},
          Defect{"UnsignedBeyondSigned",
                 [](const Spoiler& f) {
                   f.replace("/model/point/column", H5T_NATIVE_UINT64, {12}, H5T_NATIVE_UINT64,
                             too_large);
                 },
                 "/model/point/column: value 0 is 9223372036854775808, expected at most"},
          Defect{"WiderThanItsRange",
                 [](const Spoiler& f) {
                   f.convert("/model/spring/exponent", H5T_NATIVE_INT64);
                   f.set<int64_t>("/model/spring/exponent", 3, 258);
                 },
                 "/model/spring/exponent: row 3 is 258, expected -128 to 127"}};
}

INSTANTIATE_TEST_SUITE_P(Type, ModelDefect, ::testing::ValuesIn(type_defects()), name_of);

std::vector<Defect> not_finite_defects() {
  return {Defect{"PositionNotFinite", set<double>("/model/point/position", 7, nan),
                 "/model/point/position: row 2 holds nan"},
          Defect{"StiffnessInfinite", set<double>("/model/spring/stiffness", 4, INFINITY),
                 "/model/spring/stiffness: row 4 holds inf"},
          Defect{"SurfacePointNotFinite", set<double>("/model/bone_surface/1/points", 4, nan),
                 "/model/bone_surface/1/points: row 1 holds nan"}};
}

INSTANTIATE_TEST_SUITE_P(NotFinite, ModelDefect, ::testing::ValuesIn(not_finite_defects()),
                         name_of);

std::vector<Defect> index_defects() {
  return {Defect{"SpringBeyondThePoints", set<int64_t>("/model/spring/points", 5, 12),
                 "/model/spring/points: row 2 is 12, expected 0 to 11"},
          Defect{"SpringOfOnePoint",
                 [](const Spoiler& f) {
                   f.set<int64_t>("/model/spring/points", 6, 5);
                   f.set<int64_t>("/model/spring/points", 7, 5);
                 },
                 "/model/spring/points: row 3 is (5, 5), expected two different points"},
          Defect{"NegativeIndex", set<int64_t>("/model/prism/points", 6, -1),
                 "/model/prism/points: row 1 is -1, expected 0 to 11"},
          Defect{"SkinBeyondThePoints", set<int64_t>("/model/skin/points", 0, 99),
                 "/model/skin/points: row 0 is 99"},
          Defect{"SurfaceTriangleOutOfRange", set<int64_t>("/model/bone_surface/0/triangles", 2, 3),
                 "/model/bone_surface/0/triangles: row 0 is 3, expected 0 to 2"},
          Defect{"LayerNegative", set<int64_t>("/model/point/layer", 0, -1),
                 "/model/point/layer: row 0 is -1"}};
}

INSTANTIATE_TEST_SUITE_P(Index, ModelDefect, ::testing::ValuesIn(index_defects()), name_of);

std::vector<Defect> set_defects() {
  return {Defect{"SpringSetUnknown", set<int64_t>("/model/spring/set", 1, 4),
                 "/model/spring/set: row 1 is 4, expected 0 to 3"},
          Defect{"BoneUnknown", set<int64_t>("/model/point/bone", 1, 2),
                 "/model/point/bone: row 1 is 2, expected -1 to 1"},
          Defect{"BonePointWithoutBone", set<int64_t>("/model/point/bone", 1, -1),
                 "/model/point/bone: row 1 is -1, but point/set makes it a bone point"},
          Defect{"PointSetUnknown", set<int64_t>("/model/point/set", 5, 4),
                 "/model/point/set: row 5 is 4, expected 0 to 3"},
          Defect{"ExponentUnknown", set<int64_t>("/model/spring/exponent", 0, 3),
                 "/model/spring/exponent: row 0 is 3, expected 0 to 2"}};
}

INSTANTIATE_TEST_SUITE_P(Set, ModelDefect, ::testing::ValuesIn(set_defects()), name_of);

std::vector<Defect> quantity_defects() {
  return {Defect{"StiffnessNegative", set<double>("/model/spring/stiffness", 4, -1e-300),
                 "/model/spring/stiffness: row 4 is -1e-300 N/mm"},
          Defect{"MassNegative", set<double>("/model/point/mass", 3, -1),
                 "/model/point/mass: row 3 is -1 kg"},
          Defect{"RestLengthNegative", set<double>("/model/spring/rest_length", 2, -0.5),
                 "/model/spring/rest_length: row 2 is -0.5 mm"},
          Defect{"ReferenceZero", set<double>("/model/spring/reference", 2, 0),
                 "/model/spring/reference: row 2 is 0 mm, expected a finite number above 0"},
          Defect{"VolumeZero", set<double>("/model/prism/rest_volume", 1, 0),
                 "/model/prism/rest_volume: row 1 is 0 mm³"}};
}

INSTANTIATE_TEST_SUITE_P(Quantity, ModelDefect, ::testing::ValuesIn(quantity_defects()), name_of);

std::vector<Defect> consistency_defects() {
  return {
      Defect{"VolumeOfAnotherPrism", set<double>("/model/prism/rest_volume", 1, 0.41),
             "/model/prism/rest_volume: row 1 is 0.41 mm³, but the prism's volume"},
      Defect{"TransformNotRigid", set<double>("/model/bone_transform", 16, 1.1),
             "/model/bone_transform: row 1 (bone mandible): "},
      Defect{"PointThatNothingHolds",
             [](const Spoiler& f) {
               for (const char* path : {"set", "rest_length", "stiffness", "exponent", "reference"})
                 f.replace(std::string("/model/spring/") + path, H5T_NATIVE_INT8, {0});
               f.replace("/model/spring/points", H5T_NATIVE_INT8, {0, 2});
             },
             "/model/point: row 4 is soft tissue and no spring or edge holds it"}};
}

INSTANTIATE_TEST_SUITE_P(Consistency, ModelDefect, ::testing::ValuesIn(consistency_defects()),
                         name_of);

/// The small model with a point that touches a bone, and two sides of a cut.
model::Model touching_model() {
  model::Model m = small_model();
  m.contact.stiffness = 0.1;
  m.bone_surfaces[0].points = {{0, 0, -5}, {2, 0, -5}, {0, 2, -5}, {0, 0, -3}};
  m.bone_surfaces[0].triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  m.contact.bodies = {{m.bones[0], 0}};
  m.contact.pairs = {{4}, {0}, {model::Binding::touches}, {2.0}};
  m.contact.cut_faces = {{{2, 2}}, {0}, {}, std::vector<double>(8, 1.0), {0, 1, 0, 0}};
  for (int64_t c = 0; c < 8; ++c) {
    m.contact.cut_faces.point.push_back(c % static_cast<int64_t>(m.points.position.size()));
    m.contact.cut_faces.begin.push_back(c + 1);
  }
  return m;
}

class ContactDefect : public ::testing::TestWithParam<Defect> {};

TEST_P(ContactDefect, IsRefusedByName) {
  const Folder folder;
  write_small_result(folder.path("a"), touching_model());
  model::Model back;
  ASSERT_EQ(refusal([&] { back = read_model(folder.path("a.h5")); }), "accepted");
  EXPECT_EQ(back.contact.cut_faces.begin, touching_model().contact.cut_faces.begin);
  GetParam().spoil(Spoiler(folder.path("a.h5")));
  const std::string text = refusal([&] { read_model(folder.path("a.h5")); });
  EXPECT_EQ(text.rfind(folder.path("a.h5").string() + ": ", 0), 0u) << text;
  EXPECT_NE(text.find(GetParam().message), std::string::npos) << text;
}

Defect wrong_index(const char* name, const char* array, int64_t row, int64_t value) {
  static std::deque<std::string> messages;
  messages.push_back(fmt::format("{}: row {} is {}, expected ", array, row, value));
  return {name, [=](const Spoiler& f) { f.set<int64_t>(array, row, value); },
          messages.back().c_str()};
}

std::vector<Defect> contact_defects() {
  return {wrong_index("TouchOfNoPoint", "/model/contact/point", 0, 999),
          wrong_index("TouchOfNoBody", "/model/contact/body_row", 0, 1),
          wrong_index("NoSuchBinding", "/model/contact/binding", 0, 2),
          wrong_index("BodyOfNoBone", "/model/contact/body_bone", 0, 99),
          wrong_index("HugeNet", "/model/contact/wall/net", 0, int64_t{1} << 40),
          wrong_index("NetOfOneRow", "/model/contact/wall/net", 0, 1),
          wrong_index("ControlOfNothing", "/model/contact/wall/begin", 3, 2),
          wrong_index("ControlsBeyondTheirPoints", "/model/contact/wall/begin", 8, 9),
          wrong_index("SideOfNoPoint", "/model/contact/wall/point", 5, -1),
          Defect{"WeightNotFinite", set<double>("/model/contact/wall/weight", 2, nan),
                 "/model/contact/wall/weight: "},
          Defect{"AreaBelowZero", set<double>("/model/contact/wall/area", 1, -1.0),
                 "/model/contact/wall/area: row 1 is -1 mm²"}};
}

INSTANTIATE_TEST_SUITE_P(Contact, ContactDefect, ::testing::ValuesIn(contact_defects()), name_of);

/// The small model with elements of a further term, whose name need not be known to be read.
class ElementDefect : public ::testing::TestWithParam<Defect> {};

TEST_P(ElementDefect, IsRefusedByName) {
  const Folder folder;
  model::Model m = small_model();
  m.elements = {{"tie", 2, 1, {0, 1, 1, 2}, {1.0, 2.0}}, {"weight", 1, 0, {3}, {}}};
  write_small_result(folder.path("a"), m);
  model::Model back;
  ASSERT_EQ(refusal([&] { back = read_model(folder.path("a.h5")); }), "accepted");
  ASSERT_EQ(back.elements.size(), 2u);
  EXPECT_EQ(back.elements[0].term, "tie");
  EXPECT_EQ(back.elements[0].points, m.elements[0].points);
  EXPECT_EQ(back.elements[0].numbers, m.elements[0].numbers);
  EXPECT_EQ(back.elements[1].points, m.elements[1].points);
  GetParam().spoil(Spoiler(folder.path("a.h5")));
  const std::string text = refusal([&] { read_model(folder.path("a.h5")); });
  EXPECT_NE(text.find(GetParam().message), std::string::npos) << text;
}

std::vector<Defect> elements_defects() {
  return {wrong_index("ElementOfNoPoint", "/model/element/0/points", 3, 999),
          wrong_index("ElementBelowPoints", "/model/element/1/points", 0, -1),
          Defect{"PointTwice", set<int64_t>("/model/element/0/points", 3, 1),
                 "/model/element/0: element 1 has one of its points twice"},
          Defect{"NumberNotFinite", set<double>("/model/element/0/numbers", 1, nan),
                 "/model/element/0/numbers: "},
          Defect{"PointTooMany",
                 [](const Spoiler& f) {
                   f.replace("/model/element/0/points", H5T_NATIVE_INT8, {0, 1, 2});
                 },
                 "/model/element/0"}};
}

INSTANTIATE_TEST_SUITE_P(Elements, ElementDefect, ::testing::ValuesIn(elements_defects()), name_of);

class Acceptable : public ::testing::TestWithParam<Defect> {};

TEST_P(Acceptable, IsReadAsTheSameModel) {
  const Folder folder;
  const model::Model m = small_model();
  write_small_result(folder.path("a"), m);
  GetParam().spoil(Spoiler(folder.path("a.h5")));
  model::Model back;
  ASSERT_EQ(refusal([&] { back = read_model(folder.path("a.h5")); }), "accepted");
  EXPECT_EQ(back.points.column, m.points.column);
  EXPECT_EQ(back.points.set, m.points.set);
  EXPECT_EQ(back.springs.points, m.springs.points);
  EXPECT_EQ(back.spring_sets, m.spring_sets);
  for (size_t i = 0; i < m.points.position.size(); ++i)
    EXPECT_LT((back.points.position[i] - m.points.position[i]).norm(), 1e-6);
}

const char* const names[4] = {"layer 0", "layer 1", "connecting 0", "diagonal 0"};

hid_t variable_string() {
  static const hid_t type = [] {
    const hid_t copy = H5Tcopy(H5T_C_S1);
    H5Tset_size(copy, H5T_VARIABLE);
    H5Tset_cset(copy, H5T_CSET_UTF8);
    return copy;
  }();
  return type;
}

std::vector<Defect> lossless_defects() {
  return {
      Defect{"NarrowIndices",
             [](const Spoiler& f) { f.convert("/model/spring/points", H5T_NATIVE_INT16); }, ""},
      Defect{"UnsignedIndices",
             [](const Spoiler& f) { f.convert("/model/point/column", H5T_NATIVE_UINT64); }, ""},
      Defect{"BigEndianIndices",
             [](const Spoiler& f) { f.convert("/model/spring/points", H5T_STD_I32BE); }, ""},
      Defect{"WideSets", [](const Spoiler& f) { f.convert("/model/point/set", H5T_NATIVE_INT64); },
             ""},
      Defect{"SinglePrecision",
             [](const Spoiler& f) { f.convert("/model/point/position", H5T_NATIVE_FLOAT); }, ""},
      Defect{"WholeNumbersForReals",
             [](const Spoiler& f) { f.convert("/model/spring/stiffness", H5T_NATIVE_INT64); }, ""},
      Defect{"StringsOfVariableLength",
             [](const Spoiler& f) {
               f.replace("/model/spring_set", variable_string(), {4}, variable_string(), names);
             },
             ""},
      Defect{"NothingOptional",
             [](const Spoiler& f) {
               for (const char* path : {"point/mass", "point/external_force", "skin",
                                        "bone_surface", "bone_transform", "prism"})
                 f.remove(std::string("/model/") + path);
             },
             ""}};
}

INSTANTIATE_TEST_SUITE_P(Lossless, Acceptable, ::testing::ValuesIn(lossless_defects()), name_of);

class StepDefect : public ::testing::TestWithParam<Defect> {};

TEST_P(StepDefect, IsRefusedByName) {
  const Folder folder;
  const model::Model m = small_model();
  write_small_result(folder.path("a"), m);
  GetParam().spoil(Spoiler(folder.path("a.h5")));
  const std::string text = refusal([&] {
    for (int64_t s = 0; s < step_count(folder.path("a.h5")); ++s)
      read_step(folder.path("a.h5"), s, m);
  });
  EXPECT_NE(text.find(GetParam().message), std::string::npos) << text;
}

std::vector<Defect> step_defects() {
  return {Defect{"NoPosition", remove("/step/0001/point/position"),
                 "/step/0001/point/position: is missing"},
          Defect{"NotInSequence", remove("/step/0000"), "/step: has 1 groups, but 0000 is missing"},
          Defect{"NoLoad", remove_attribute("/step/0001", "load"),
                 "/step/0001 attribute load: is missing"},
          Defect{"TensionNotFinite", set<double>("/step/0000/spring/tension", 3, nan),
                 "/step/0000/spring/tension: row 3 holds nan"}};
}

INSTANTIATE_TEST_SUITE_P(Step, StepDefect, ::testing::ValuesIn(step_defects()), name_of);

TEST(BadFile, IsRefusedWithItsName) {
  const Folder folder;
  std::ofstream(folder.path("text.h5")) << "no model\n";
  std::ofstream(folder.path("empty.h5"));
  const auto refused = [&](const char* name) {
    return refusal([&] { read_model(folder.path(name)); });
  };
  EXPECT_NE(refused("none.h5").find("none.h5: no such file; give what repose-solve writes"),
            std::string::npos);
  EXPECT_NE(refused("text").find("text: no such file; give " + folder.path("text.h5").string()),
            std::string::npos);
  EXPECT_NE(refused("").find("is a folder"), std::string::npos);
  EXPECT_NE(refused("text.h5").find("text.h5: is not an HDF5 file"), std::string::npos);
  EXPECT_NE(refused("empty.h5").find("empty.h5: is not an HDF5 file"), std::string::npos);
}

TEST(BadFile, TruncatedAnywhereIsRefused) {
  const Folder folder;
  write_small_result(folder.path("a"), small_model());
  const auto whole = std::filesystem::file_size(folder.path("a.h5"));
  for (const double part : {0.01, 0.1, 0.5, 0.9, 0.9999}) {
    std::filesystem::copy_file(folder.path("a.h5"), folder.path("cut.h5"),
                               std::filesystem::copy_options::overwrite_existing);
    std::filesystem::resize_file(folder.path("cut.h5"),
                                 static_cast<std::uintmax_t>(part * static_cast<double>(whole)));
    const std::string text = refusal([&] { read_model(folder.path("cut.h5")); });
    EXPECT_NE(text.find("cut.h5: cannot be read as an HDF5 file: truncated file"),
              std::string::npos)
        << text;
  }
}

}  // namespace refusal_test
}  // namespace repose::results
