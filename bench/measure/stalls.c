/* Reports when the machine stalled: a thread on each processor, above all others, wakes every half millisecond.
   Time that it misses, nobody had. Ends with its standard input; then prints, for each time it woke late by more than
   the argument [us]: when it was due [ns of the monotonic clock] and how late it was [ns]. */
#define _GNU_SOURCE
#include <pthread.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <time.h>
#include <unistd.h>

#define STEP 500000L
#define MOST 100000
#define PROCESSORS 64

static struct { long due, late; } found[PROCESSORS][MOST];
static int counts[PROCESSORS];
static long threshold;
static volatile int ending;

static long now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1000000000L + t.tv_nsec;
}

static void *watch(void *argument) {
    long cpu = (long)argument;
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(cpu, &set);
    pthread_setaffinity_np(pthread_self(), sizeof set, &set);
    struct sched_param priority = {.sched_priority = 90};
    pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority);
    prctl(PR_SET_TIMERSLACK, 1);
    for (long due = now() + STEP; !ending; due += STEP) {
        struct timespec t = {due / 1000000000L, due % 1000000000L};
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, 0);
        long late = now() - due;
        if (late > threshold && counts[cpu] < MOST) {
            found[cpu][counts[cpu]].due = due;
            found[cpu][counts[cpu]++].late = late;
        }
        if (late > STEP) due += late / STEP * STEP;
    }
    return 0;
}

int main(int count, char **words) {
    if (count != 2) return 1;
    threshold = atol(words[1]) * 1000L;
    mlockall(MCL_CURRENT | MCL_FUTURE);
    long processors = sysconf(_SC_NPROCESSORS_ONLN);
    if (processors > PROCESSORS) processors = PROCESSORS;
    pthread_t threads[PROCESSORS];
    for (long cpu = 0; cpu < processors; cpu++) pthread_create(&threads[cpu], 0, watch, (void *)cpu);
    puts("ready");
    fflush(stdout);
    while (getchar() != EOF) {}
    ending = 1;
    for (long cpu = 0; cpu < processors; cpu++) pthread_join(threads[cpu], 0);
    for (long cpu = 0; cpu < processors; cpu++)
        for (int k = 0; k < counts[cpu]; k++) printf("%ld %ld\n", found[cpu][k].due, found[cpu][k].late);
    return 0;
}
