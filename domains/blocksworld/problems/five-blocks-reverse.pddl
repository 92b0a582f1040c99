; A tower of five is turned upside down.
(define (problem five-blocks-reverse)
  (:domain blocksworld)
  (:objects
    blue_block green_block orange_block red_block yellow_block - block
    arm - robot)
  (:init
    (handempty arm)
    (ontable red_block) (on orange_block red_block) (on yellow_block orange_block) (on green_block yellow_block) (on blue_block green_block) (clear blue_block))
  (:goal (and
    (on green_block blue_block)
    (on yellow_block green_block)
    (on orange_block yellow_block)
    (on red_block orange_block))))
