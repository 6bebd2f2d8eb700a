// The C++ header beside the C kernels; benchmarks/cpp.py fills in what is between at signs.
#define main driver_main
#include "driver.cpp"
#undef main
#include <chrono>

extern "C" {
@DECLARED@
}

namespace {

std::uint64_t state = 0x9E3779B97F4A7C15U;

// A number between 0 and 1 (xorshift64*).
double uniform()
{
    state ^= state >> 12U;
    state ^= state << 25U;
    state ^= state >> 27U;
    return static_cast<double>((state * 0x2545F4914F6CDD1DU) >> 11U) / 9007199254740992.0;
}

const double box[][2] = {@BOX@};

template <class Real>
struct Both {
    const char* name;
    std::size_t inputs;
    std::size_t results;
    bool is_pose; // the inputs begin with a pose
    bool is_joints; // the inputs begin with joint values
    void (*c)(const Real*, Real*);
    void (*cpp)(std::size_t, const Real*, Real*@PARAMS@);
};

template <class Real>
void fill(const Both<Real>& both, Real* given, void (*fk)(const Real*, Real*), const std::size_t dof, const std::size_t tips)
{
    Real joints[256] = {};
    std::vector<Real> poses(16 * tips);
    const double spread = uniform() < 0.25 ? 20.0 : 1.0;
    for (std::size_t i = 0; i < dof; ++i) {
        joints[i] = static_cast<Real>(box[i][0] + (box[i][1] - box[i][0]) * (0.5 + (uniform() - 0.5) * spread));
    }
    for (std::size_t i = 0; i < both.inputs; ++i) {
        given[i] = both.is_joints && i < dof ? joints[i] : static_cast<Real>(4.0 * uniform() - 2.0);
    }
    if (both.is_pose) {
        fk(joints, poses.data());
        std::memcpy(given, poses.data(), 16 * sizeof(Real));
    }
    if (both.inputs > 0 && uniform() < 1.0 / 16.0) {
        const Real odd[] = {std::numeric_limits<Real>::quiet_NaN(), std::numeric_limits<Real>::infinity(),
            -std::numeric_limits<Real>::infinity(), Real(1e7), Real(-1e30), Real(1e-38), Real(-0.0)};
        const auto place = static_cast<std::size_t>(uniform() * static_cast<double>(both.inputs));
        given[place] = odd[static_cast<std::size_t>(uniform() * 7.0)];
    }
}

template <class Real>
void compare(const std::size_t n, const Both<Real>* all, const std::size_t count, void (*fk)(const Real*, Real*), unsigned long long* words, unsigned long long* wrong)
{
    for (std::size_t index = 0; index < count; ++index) {
        const Both<Real>& both = all[index];
        std::vector<Real> given(both.inputs + 1), one(both.results + 1, Real(-7)), other(both.results + 1, Real(-7));
        for (std::size_t i = 0; i < n; ++i) {
            fill(both, given.data(), fk, @DOF@, @TIPS@);
            both.c(given.data(), one.data());
            both.cpp(1, given.data(), other.data()@NONE@);
            for (std::size_t k = 0; k < both.results; ++k) {
                const bool same = std::memcmp(&one[k], &other[k], sizeof(Real)) == 0 || (one[k] != one[k] && other[k] != other[k]);
                *wrong += same ? 0U : 1U;
            }
            *words += both.results;
        }
    }
}

template <class Work>
double nanoseconds(const Work& work)
{
    double least = 1e9;
    for (int round = 0; round < 15; ++round) {
        const auto from = std::chrono::steady_clock::now();
        for (int i = 0; i < 100000; ++i) {
            work(i);
        }
        const std::chrono::duration<double, std::nano> spent = std::chrono::steady_clock::now() - from;
        least = spent.count() / 100000 < least ? spent.count() / 100000 : least;
    }
    return least;
}

template <class Real>
void race(void (*c)(const Real*, Real*), const char* name)
{
    @ROBOT@::Joints<Real> q{};
    Real result[16 * @TIPS@] = {};
    Real sum = 0;
    const auto move = [&](const int i) {
        for (Real& each : q) {
            each = Real(0.1) + Real(i & 1023) * Real(1e-3);
        }
    };
    double of_c = 1e9;
    double of_cpp = 1e9;
    for (int turn = 0; turn < 4; ++turn) {
        const double first = nanoseconds([&](const int i) { move(i); c(q.data(), result); sum += result[3]; });
        const double second = nanoseconds([&](const int i) { move(i); sum += @ROBOT@::fk(q).data()[3]; });
        of_c = first < of_c ? first : of_c;
        of_cpp = second < of_cpp ? second : of_cpp;
    }
    std::printf(", \"%s\": [%.2f, %.2f]", name, of_c, of_cpp);
    std::fprintf(stderr, "%g\n", static_cast<double>(sum));
}

} // namespace

int main(int, char** argv)
{
    const std::size_t n = std::strtoull(argv[1], nullptr, 10);
    unsigned long long words = 0;
    unsigned long long wrong = 0;
@TABLES@
    std::printf("{\"words\": %llu, \"wrong\": %llu", words, wrong);
    if (argv[2][0] == '1') {
        race<double>(c_fk_double, "double");
        race<float>(c_fk_float, "float");
    }
    std::printf("}\n");
    return 0;
}
