; The classic task with 7 disks: 127 moves.
(define (problem seven-disks)
  (:domain hanoi)
  (:objects
    red_disk orange_disk yellow_disk green_disk blue_disk purple_disk pink_disk - disk
    left_peg middle_peg right_peg - peg)
  (:init
    (on-peg red_disk left_peg) (on-peg orange_disk left_peg) (on-peg yellow_disk left_peg)
    (on-peg green_disk left_peg) (on-peg blue_disk left_peg) (on-peg purple_disk left_peg)
    (on-peg pink_disk left_peg)
    (on orange_disk red_disk) (on yellow_disk orange_disk) (on green_disk yellow_disk)
    (on blue_disk green_disk) (on purple_disk blue_disk) (on pink_disk purple_disk)
    (clear pink_disk)
    (smaller orange_disk red_disk) (smaller yellow_disk red_disk) (smaller green_disk red_disk)
    (smaller blue_disk red_disk) (smaller purple_disk red_disk) (smaller pink_disk red_disk)
    (smaller yellow_disk orange_disk) (smaller green_disk orange_disk)
    (smaller blue_disk orange_disk) (smaller purple_disk orange_disk)
    (smaller pink_disk orange_disk)
    (smaller green_disk yellow_disk) (smaller blue_disk yellow_disk)
    (smaller purple_disk yellow_disk) (smaller pink_disk yellow_disk)
    (smaller blue_disk green_disk) (smaller purple_disk green_disk) (smaller pink_disk green_disk)
    (smaller purple_disk blue_disk) (smaller pink_disk blue_disk)
    (smaller pink_disk purple_disk))
  (:goal (forall (?d - disk) (on-peg ?d right_peg))))
