/* Sends monitoring messages at 1 kHz to a client and, half a period later, to an echo; measures both replies.

   Arguments: client's port, echo's port, processor, cycles, datagrams (a file: monitoring, waiting, active; each with
   its length in four bytes before it and counters of five bytes), results (a file of doubles: client's and echo's
   latency [us] by turns, NaN where no reply came within the half period). */
#define _GNU_SOURCE
#include <arpa/inet.h>
#include <math.h>
#include <poll.h>
#include <sched.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <time.h>

#define HALF 500000LL
#define FIRST 300000000u
#define WARM 400

static int64_t now(clockid_t clock) {
    struct timespec t;
    clock_gettime(clock, &t);
    return t.tv_sec * 1000000000LL + t.tv_nsec;
}

static void until(int64_t due) {
    struct timespec t = {.tv_sec = (due - 30000) / 1000000000LL, .tv_nsec = (due - 30000) % 1000000000LL};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL);
    while (now(CLOCK_MONOTONIC) < due) {}
}

static void counter(unsigned char *at, uint32_t value) {
    for (int i = 0; i < 5; i++, value >>= 7) at[i] = (value & 0x7f) | (i < 4 ? 0x80 : 0);
}

static double reply(int sock, int64_t sent, int64_t end) {
    char buffer[2048], control[128];
    for (;;) {
        struct pollfd one = {.fd = sock, .events = POLLIN};
        int64_t rest = end - now(CLOCK_MONOTONIC);
        struct timespec limit = {.tv_nsec = rest > 0 ? rest : 0};
        if (ppoll(&one, 1, &limit, NULL) <= 0) return NAN;
        struct iovec part = {buffer, sizeof buffer};
        struct msghdr message = {.msg_iov = &part, .msg_iovlen = 1, .msg_control = control, .msg_controllen = sizeof control};
        if (recvmsg(sock, &message, MSG_DONTWAIT) <= 0) continue;
        struct cmsghdr *head = CMSG_FIRSTHDR(&message);
        struct timespec stamp;
        if (!head || head->cmsg_type != SCM_TIMESTAMPNS) continue;
        memcpy(&stamp, CMSG_DATA(head), sizeof stamp);
        int64_t came = stamp.tv_sec * 1000000000LL + stamp.tv_nsec;
        if (came >= sent) return (came - sent) / 1e3; /* an earlier one is the late reply to the message before */
    }
}

int main(int count, char **words) {
    if (count != 7) return 1;
    int ports[2] = {atoi(words[1]), atoi(words[2])}, cpu = atoi(words[3]), cycles = atoi(words[4]), socks[2];
    unsigned char data[3][2048];
    uint32_t sizes[3];
    FILE *file = fopen(words[5], "rb");
    for (int i = 0; i < 3; i++)
        if (fread(&sizes[i], 4, 1, file) != 1 || fread(data[i], 1, sizes[i], file) != sizes[i]) return 1;
    fclose(file);
    double *found = calloc(2 * (size_t)cycles, sizeof(double));
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(cpu, &set);
    struct sched_param priority = {.sched_priority = 50};
    sched_setaffinity(0, sizeof set, &set);
    if (sched_setscheduler(0, SCHED_FIFO, &priority)) fputs("no real-time priority for the sender\n", stderr);
    prctl(PR_SET_TIMERSLACK, 1);
    mlockall(MCL_CURRENT | MCL_FUTURE);
    for (int i = 0; i < 2; i++) {
        int on = 1;
        struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons(ports[i])};
        to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socks[i] = socket(AF_INET, SOCK_DGRAM, 0);
        setsockopt(socks[i], SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
        if (connect(socks[i], (struct sockaddr *)&to, sizeof to)) return 1;
    }
    int64_t due = now(CLOCK_MONOTONIC) + 100000000LL;
    for (int cycle = -WARM; cycle < cycles; cycle++) {
        int kind = cycle < -WARM / 2 ? 0 : cycle < -WARM / 4 ? 1 : 2;
        uint32_t number = FIRST + WARM + cycle;
        counter(data[kind] + 8, number);
        counter(data[kind] + 14, number);
        for (int side = 0; side < 2; side++, due += HALF) {
            until(due);
            int64_t sent = now(CLOCK_REALTIME);
            if (send(socks[side], data[kind], sizes[kind], 0) < 0) continue;
            double took = reply(socks[side], sent, due + HALF - 60000);
            if (cycle >= 0) found[2 * cycle + side] = took;
        }
    }
    file = fopen(words[6], "wb");
    fwrite(found, sizeof(double), 2 * (size_t)cycles, file);
    return fclose(file);
}
