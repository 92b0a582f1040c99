(define (problem e_before_and_behind)
  (:domain blocksworld)
  (:objects red_block - block blue_block - block green_block - block yellow_block - block purple_block - block orange_block - block pink_block - block cyan_block - block)
  (:init
    (on cyan_block orange_block)
    (on red_block yellow_block))
  (:goal (and))
)
