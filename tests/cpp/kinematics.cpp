// Computes what each line of standard input asks for: a robot, a word, numbers; see test_kinematics.py.
#include <heptarm/kinematics.hpp>

#include <iomanip>
#include <iostream>
#include <sstream>

using namespace heptarm;

template <std::size_t size>
static std::array<double, size> numbers(std::istream& line) {
    std::array<double, size> found;
    for (double& one : found) {
        std::string word;
        line >> word;
        one = std::stod(word);
    }
    return found;
}

static void print(double value) { std::cout << value << " "; }

template <class Value, std::size_t size>
static void print(const std::array<Value, size>& values) {
    for (const Value& one : values) print(one);
}

static void answer(std::istream& line) {
    std::string robot, word;
    line >> robot >> word;
    const Kinematics arm(robot);
    if (word == "forward") {
        const wire::Pose pose = arm.forward(numbers<7>(line));
        print(pose.xyz), print(pose.quat);
    } else if (word == "jacobian") {
        const Joints q = numbers<7>(line);
        print(arm.jacobian(q)), print(arm.jacobian(q, numbers<3>(line)));
    } else if (word == "redundancy") {
        const Joints q = numbers<7>(line);
        const wire::Redundancy found = arm.redundancy(q);
        print(found.e1), print(found.status), print(found.turn), print(arm.arm_angle(q));
    } else if (word == "wrench") {
        const Joints q = numbers<7>(line);
        print(arm.wrench(q, numbers<7>(line)));
    } else {  // solve
        wire::Pose pose;
        pose.xyz = numbers<3>(line), pose.quat = numbers<4>(line);
        SolveOptions options;
        while (line >> word) {
            if (word == "near") options.near = numbers<7>(line);
            if (word == "e1") options.e1 = numbers<1>(line)[0];
            if (word == "status") options.status = int(numbers<1>(line)[0]);
        }
        print(arm.solve(pose, options));
    }
}

int main() {
    std::cout << std::setprecision(17);
    for (std::string text; std::getline(std::cin, text);) {
        std::istringstream line(text);
        try {
            answer(line);
        } catch (const LimitError& error) {
            std::cout << "error " << error.code << " " << error.what();
        } catch (const std::invalid_argument& error) {
            std::cout << "error 0 " << error.what();
        }
        std::cout << std::endl;
    }
}
